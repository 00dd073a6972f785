"""Absolute differences of gray levels between rows or columns, in which compression and interlacing show."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
"""Gray levels of an image, shape (H, W)."""


def differences(levels: Bytes, order: int, axis: int) -> NDArray[Any]:
    """Return the absolute differences of gray levels.

    Parameters
    ----------
    levels
        Gray levels, shape (H, W), uint8.
    order
        Order of the differences.
    axis
        0 for differences of rows, 1 for those of columns.

    Returns
    -------
    NDArray
        Absolute differences, at most 255, uint8; shape (H - order, W) or (H, W - order).

    Examples
    --------
    >>> differences(np.array([[1, 4, 9, 16]], np.uint8), 2, axis=1).tolist()
    [[2, 2]]
    """
    values: NDArray[Any] = levels.astype(np.int16)
    for _ in range(order):
        later, earlier = (values[1:], values[:-1]) if axis == 0 else (values[:, 1:], values[:, :-1])
        values = cv2.subtract(later, earlier)
    return np.asarray(cv2.convertScaleAbs(values))


def at_most(values: NDArray[Any], limit: int) -> NDArray[Any]:
    """Return values cut off at a limit.

    Parameters
    ----------
    values
        Values, shape (H, W).
    limit
        The limit.

    Returns
    -------
    NDArray
        The values, those above the limit equal to it.
    """
    return cv2.threshold(values, limit, 255, cv2.THRESH_TRUNC)[1]
