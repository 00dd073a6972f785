"""Patches about features, resampled so that all balls are equally large and round, whatever the camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Single


@dataclass(frozen=True)
class PatchGrid:
    """The samples of a patch.

    Attributes
    ----------
    size
        Samples per side.
    radius
        Samples per radius of a ball.
    """

    size: int
    radius: float


def cut_patches(
    tone: Single, centre_px: NDArray[np.integer], ball_px: tuple[float, float], grid: PatchGrid
) -> Single:
    """Return the patches about pixels of an image.

    Rows and columns are resampled by two matrices that are common to all patches.

    Parameters
    ----------
    tone
        Logarithm of the gray levels, shape (H, W); continued beyond the border by the nearest pixel.
    centre_px
        Centres (u, v) of the patches, shape (n, 2), whole px.
    ball_px
        Width and height of a ball, px.
    grid
        Samples of a patch.

    Returns
    -------
    Single
        Patches, shape (n, size, size).

    Examples
    --------
    >>> ramp = np.tile(np.arange(100, dtype=np.float32), (100, 1))
    >>> cut_patches(ramp, np.array([[50, 50]]), (10.0, 10.0), PatchGrid(3, 1.0))[0].round(2)
    array([[45., 50., 55.],
           [45., 50., 55.],
           [45., 50., 55.]], dtype=float32)
    """
    across, down = (resampling(size / 2, grid) for size in ball_px)
    narrow = (_windows(tone, centre_px, down.shape[1], across.shape[1]) @ across.T).reshape(
        down.shape[1], len(centre_px) * grid.size
    )
    return np.ascontiguousarray((down @ narrow).reshape(grid.size, len(centre_px), grid.size).swapaxes(0, 1))


def _windows(tone: Single, centre_px: NDArray[np.integer], high: int, wide: int) -> Single:
    """Return the pixels (high, n, wide) about n whole pixels; rows come first, so that one product resamples all."""
    (h, w), (u, v) = tone.shape, centre_px.T
    rows = (v + np.arange(high)[:, None] - high // 2).clip(0, h - 1)
    first = u - wide // 2
    inside = (first >= 0) & (first + wide <= w)
    if wide <= w and inside.all():
        return np.asarray(np.lib.stride_tricks.sliding_window_view(tone, wide, axis=1)[rows, first])
    columns = (first[:, None] + np.arange(wide)).clip(0, w - 1)
    return np.asarray(tone[rows[:, :, None], columns])


def resampling(radius_px: float, grid: PatchGrid) -> Single:
    """Return the matrix that resamples the pixels about a centre to the samples of a grid.

    Each sample is a mean weighted by Keys's cubic kernel, widened where samples are farther apart than pixels.

    Parameters
    ----------
    radius_px
        Radius of a ball, px.
    grid
        Samples of a patch.

    Returns
    -------
    Single
        Weights, shape (size, k), of k = 2 m + 1 pixels.

    References
    ----------
    R. G. Keys, Cubic convolution interpolation for digital image processing, IEEE Trans. ASSP 29, 1981.

    Examples
    --------
    >>> bool(np.allclose(resampling(7.0, PatchGrid(25, 5.0)).sum(axis=1), 1))
    True
    """
    step = radius_px / grid.radius
    width = max(step, 1.0)
    positions = (np.arange(grid.size) - (grid.size - 1) / 2) * step
    reach = int(np.ceil(positions[-1] + 2 * width))
    t = np.abs(positions[:, None] - np.arange(-reach, reach + 1)) / width
    near, far = 1.5 * t**3 - 2.5 * t**2 + 1, -0.5 * t**3 + 2.5 * t**2 - 4 * t + 2
    weight = np.where(t < 1, near, np.where(t < 2, far, 0))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True), dtype=np.float32)
