"""Patches about features, resampled so that every ball is equally large and round, whatever the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Single = NDArray[np.float32]

_LOG_OFFSET = np.float32(4.0)
"""Gray levels added before the logarithm, which keeps noise in the dark from growing."""


@dataclass(frozen=True)
class PatchGrid:
    """The grid of a patch: ``size`` x ``size`` samples, of which ``radius`` make up the radius of a ball."""

    size: int
    radius: float


def patch_tone(gray: Single) -> Single:
    """Turn gray levels (H, W) of 0..255 into their logarithms, in place, since pictures may be large; return them."""
    gray += _LOG_OFFSET
    return np.asarray(np.log(gray, out=gray))


def cut_patches(
    picture: Single, centre_px: NDArray[np.integer], ball_px: tuple[float, float], grid: PatchGrid
) -> Single:
    """Return the patches (n, size, size) about whole pixels (n, 2) of a picture (H, W).

    ``ball_px``: (width, height) of a ball. Rows and columns are resampled by two fixed matrices, the same for all
    patches; beyond the picture's edge the edge is repeated.
    """
    across, down = (resampling(size / 2, grid) for size in ball_px)
    (a, b), (h, w) = (across.shape[1] // 2, down.shape[1] // 2), picture.shape
    u = (centre_px[:, :1] + np.arange(-a, a + 1)).clip(0, w - 1)
    v = (centre_px[:, 1:] + np.arange(-b, b + 1)).clip(0, h - 1)
    windows = picture[v[:, :, None], u[:, None, :]]
    return np.asarray(down @ (windows @ across.T))


def resampling(radius_px: float, grid: PatchGrid) -> Single:
    """Return the matrix (size, k) that resamples k = 2 m + 1 pixels about a centre to the samples of a grid.

    Each sample is a mean weighted by Keys's cubic kernel, widened where samples lie wider apart than pixels.
    """
    step = radius_px / grid.radius
    width = max(step, 1.0)
    places = (np.arange(grid.size) - (grid.size - 1) / 2) * step
    reach = int(np.ceil(places[-1] + 2 * width))
    t = np.abs(places[:, None] - np.arange(-reach, reach + 1)) / width
    near, far = 1.5 * t**3 - 2.5 * t**2 + 1, -0.5 * t**3 + 2.5 * t**2 - 4 * t + 2
    weight = np.where(t < 1, near, np.where(t < 2, far, 0))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True), dtype=np.float32)
