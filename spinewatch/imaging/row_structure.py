"""What interlacing leaves in the gray levels: rows that differ from their neighbours, or are doubled."""

from __future__ import annotations

import cv2

from spinewatch.imaging.level_differences import Bytes, at_most, differences


def row_structure(levels: Bytes) -> tuple[float, float]:
    """Return what tells fields of an interlaced frame from rows of one exposure.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.

    Returns
    -------
    comb : float
        Difference of rows from the mean of their neighbours over the difference of the neighbours.
    pairing : float
        Smaller over larger of the mean differences of rows 2k, 2k + 1 and of rows 2k + 1, 2k + 2; 0 for doubled rows.
    """
    between = at_most(cv2.absdiff(levels[2:], levels[:-2]), 30)
    own = at_most(differences(levels, 2, axis=0), 60)
    steps = cv2.reduce(cv2.absdiff(levels[1:], levels[:-1]), 1, cv2.REDUCE_AVG, dtype=cv2.CV_32F).ravel()
    n = len(steps) // 2 * 2
    even, odd = float(steps[:n:2].mean()), float(steps[1:n:2].mean())
    comb = cv2.mean(own)[0] / 2 / max(cv2.mean(between)[0], 1e-3)
    return comb, min(even, odd) / max(even, odd, 1e-3)
