"""Noise filters."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Single


def truncated_median_filter(gray: Single) -> Single:
    """Return the 3 x 3 truncated median: a robust estimate of the local mode, which keeps edges sharp.

    Of nine sorted values the smallest and the largest are discarded as unstable (the noniles of the thesis). The longer
    of the two tails is cut to the length of the shorter one about the median, and the median of the rest is the result.

    Parameters
    ----------
    gray
        Gray levels, shape (H, W); continued beyond the border by the nearest pixel.

    Returns
    -------
    Single
        Filtered gray levels, shape (H, W).

    References
    ----------
    Thesis section 4.2.3.

    Examples
    --------
    >>> impulse = np.full((3, 3), 50, np.float32)
    >>> impulse[1, 1] = 255
    >>> truncated_median_filter(impulse)[1, 1]
    np.float32(50.0)
    """
    padded = np.pad(gray, 1, mode="edge")
    h, w = gray.shape
    window = np.stack([padded[i : i + h, j : j + w] for i in range(3) for j in range(3)])
    window.sort(axis=0)
    low, median, high = window[1], window[4], window[7]
    tail = np.minimum(median - low, high - median)
    below = (window[1:4] < median - tail).sum(axis=0)
    above = (window[5:8] > median + tail).sum(axis=0)
    # Of the seven values 1..7 those cut are removed; `doubled` is twice the index of the median of the rest.
    doubled = 8 + below - above
    lower = np.take_along_axis(window, (doubled // 2)[None], axis=0)[0]
    upper = np.take_along_axis(window, ((doubled + 1) // 2)[None], axis=0)[0]
    return np.asarray((lower + upper) / 2, dtype=np.float32)
