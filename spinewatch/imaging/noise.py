"""Noise of the gray levels, and whether all of them occur."""

from __future__ import annotations

import cv2
import numpy as np

from spinewatch.imaging.level_differences import Bytes
from spinewatch.robust import MAD_TO_SD

_NOISE_KERNEL = np.array([1, -2, 1], np.float32)
_NOISE_GAIN = 6.0
"""Standard deviation of the second differences in both directions over that of independent noise."""


def noise_levels(levels: Bytes) -> float:
    """Return the standard deviation of the noise.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    float
        Standard deviation, gray levels: from the median of second differences in both directions, to which edges
        contribute little.

    References
    ----------
    J. Immerkaer, Fast noise variance estimation, 1996; with the median in place of the mean.
    """
    second = cv2.convertScaleAbs(cv2.sepFilter2D(levels, cv2.CV_16S, _NOISE_KERNEL, _NOISE_KERNEL))
    counts = cv2.calcHist([second], [0], None, [256], [0, 256]).ravel().cumsum()
    half = counts[-1] / 2
    index = int(np.searchsorted(counts, half))
    below = float(counts[index - 1]) if index else 0.0
    # The median of whole numbers, between the edges of its bin.
    middle = index - 0.5 + (half - below) / max(float(counts[index]) - below, 1.0)
    return MAD_TO_SD / _NOISE_GAIN * max(0.0, float(middle))


def levels_share(levels: Bytes) -> float:
    """Return the share of gray levels that occur between the 1st and the 99th percentile.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    float
        Share of the levels, 0 to 1; small when an image has fewer than 8 bits.
    """
    counts = cv2.calcHist([levels[::2]], [0], None, [256], [0, 256]).ravel()
    low, high = np.searchsorted(counts.cumsum(), np.array([0.01, 0.99]) * counts.sum())
    return float((counts[low : high + 1] > 0).mean())
