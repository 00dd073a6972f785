"""Patches about features, resampled so that all balls are equally large and round, whatever the camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

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
    windows = _windows(tone, centre_px, down.shape[1], across.shape[1])
    narrow = windows.reshape(-1, across.shape[1]) @ across.T
    return np.asarray(down @ narrow.reshape(len(centre_px), down.shape[1], grid.size))


def _windows(tone: Single, centre_px: NDArray[np.integer], high: int, wide: int) -> Single:
    """Return the pixels (n, high, wide) about n whole pixels."""
    (h, w), (u, v) = tone.shape, centre_px.T
    left, top = u - wide // 2, v - high // 2
    outside = (left < 0) | (top < 0) | (left + wide > w) | (top + high > h)
    if wide > w or high > h:
        return _clamped_windows(tone, left, top, high, wide)
    view = np.lib.stride_tricks.sliding_window_view(tone, (high, wide))
    windows = np.asarray(view[top.clip(0, h - high), left.clip(0, w - wide)])
    windows[outside] = _clamped_windows(tone, left[outside], top[outside], high, wide)
    return windows


def _clamped_windows(
    tone: Single, left: NDArray[np.integer], top: NDArray[np.integer], high: int, wide: int
) -> Single:
    """Return windows (n, high, wide) that reach beyond the border, where the nearest pixel continues the image."""
    rows = (top[:, None] + np.arange(high)).clip(0, tone.shape[0] - 1)
    columns = (left[:, None] + np.arange(wide)).clip(0, tone.shape[1] - 1)
    return np.asarray(tone[rows[:, :, None], columns[:, None]])


@lru_cache(maxsize=16)
def resampling(radius_px: float, grid: PatchGrid) -> Single:
    """Return the matrix that resamples the pixels about a centre to the samples of a grid (read-only).

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
    normalized = np.asarray(weight / weight.sum(axis=1, keepdims=True), dtype=np.float32)
    normalized.flags.writeable = False
    return normalized
