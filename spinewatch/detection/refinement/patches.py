"""Patches about features, resampled so that every ball is equally large and round, whatever the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Single

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
    narrow = (_windows(picture, centre_px, down.shape[1], across.shape[1]) @ across.T).reshape(
        down.shape[1], len(centre_px) * grid.size
    )
    return np.ascontiguousarray((down @ narrow).reshape(grid.size, len(centre_px), grid.size).swapaxes(0, 1))


def _windows(picture: Single, centre_px: NDArray[np.integer], high: int, wide: int) -> Single:
    """Return the pixels (high, n, wide) about n whole pixels; rows come first, so that one product resamples all."""
    (h, w), (u, v) = picture.shape, centre_px.T
    rows = (v + np.arange(high)[:, None] - high // 2).clip(0, h - 1)
    first = u - wide // 2
    inside = (first >= 0) & (first + wide <= w)
    if wide <= w and inside.all():
        return np.asarray(np.lib.stride_tricks.sliding_window_view(picture, wide, axis=1)[rows, first])
    columns = (first[:, None] + np.arange(wide)).clip(0, w - 1)
    return np.asarray(picture[rows[:, :, None], columns])


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
