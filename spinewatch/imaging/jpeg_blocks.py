"""What the blocks of JPEG compression leave in the gray levels: steps at their borders, and jumps of damaged data."""

from __future__ import annotations

from statistics import median

import cv2
import numpy as np

from spinewatch.arrays import Float
from spinewatch.imaging.level_differences import Bytes, at_most, differences

BLOCK_PX = 8
"""Width and height of a block."""


def blockiness(levels: Bytes) -> float:
    """Return how much larger third differences are at one of eight phases than at the others.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    float
        Mean absolute third difference at the largest phase over the median of the others, or over the opposite
        phase when that is larger; along rows or along columns, whichever is smaller; about 1 without blocks of 8 px.
    """
    return min(_phase_ratio(levels, axis) for axis in (0, 1))


def _phase_ratio(levels: Bytes, axis: int) -> float:
    """Return the ratio of the largest phase to the others, of differences along an axis."""
    third = at_most(differences(levels, 3, axis), 64)
    profile = cv2.reduce(third, 1 - axis, cv2.REDUCE_AVG, dtype=cv2.CV_32F).ravel()[2:-3]
    phases = profile[: len(profile) // BLOCK_PX * BLOCK_PX].reshape(-1, BLOCK_PX).mean(axis=0)
    largest = int(phases.argmax())
    # Enlarged images have patterns of 2 or 4 px, which the opposite phase shares.
    others = max(float(median(np.delete(phases, largest).tolist())), float(phases[largest - BLOCK_PX // 2]))
    return float(phases[largest]) / max(others, 1e-3)


def raster_step(levels: Bytes) -> tuple[float, float]:
    """Return the largest step of the gray levels between rows of blocks, in raster order of the blocks.

    When the decoder loses its place in a JPEG, all blocks after one are brighter or darker: the step is at the upper
    border of the rest of this row of blocks and of the beginning of the next.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8; blocks begin at the upper left corner.

    Returns
    -------
    step : float
        Mean step over one row of blocks, gray levels.
    share : float
        Step over the mean absolute step there.
    """
    rows, columns = (n // BLOCK_PX for n in levels.shape)
    blocks = levels[: rows * BLOCK_PX, : columns * BLOCK_PX].reshape(rows, BLOCK_PX, columns * BLOCK_PX)
    above, below = blocks[:-1, -2:].astype(np.int16), blocks[1:, :2].astype(np.int16)
    step = (below[:, 0] - above[:, 1]) - ((above[:, 1] - above[:, 0]) + (below[:, 1] - below[:, 0])) / 2
    steps = np.median(step.reshape(-1, columns, BLOCK_PX).clip(-48, 48), axis=2).ravel()
    mean, size = _moving_mean(steps, columns), _moving_mean(np.abs(steps), columns)
    best = int(np.abs(mean).argmax())
    return float(abs(mean[best])), float(abs(mean[best]) / max(size[best], 1e-9))


def _moving_mean(values: Float, n: int) -> Float:
    """Return means (m - n + 1,) of n successive of m values."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[n:] - total[:-n]) / n)
