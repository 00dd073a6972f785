"""Features of a feature space: local maxima, or connected components of the best pixels (thesis section 4.3.3)."""

from __future__ import annotations

import cv2
import numpy as np

from spinewatch.arrays import Floating


def peaks(space: Floating, max_peaks: int, radius_px: int, min_score: float) -> tuple[Floating, Floating]:
    """Return the highest local maxima of a feature space, best first.

    A maximum is the highest value within a square of ``radius_px`` (non-maximum suppression). Its sub-pixel position is
    the vertex of the parabolas through its neighbours in u and in v.

    Parameters
    ----------
    space
        Feature space, shape (H, W).
    max_peaks
        Number of maxima to return at most.
    radius_px
        Half side of the square, px.
    min_score
        Maxima must exceed this value.

    Returns
    -------
    xy_px : Floating
        Positions (u, v), shape (n, 2), px.
    score : Floating
        Values at the maxima, shape (n,).

    Examples
    --------
    >>> space = np.zeros((5, 7), np.float32)
    >>> space[2, 2:5] = 0.5, 0.9, 0.7
    >>> xy_px, score = peaks(space, max_peaks=3, radius_px=1, min_score=0.2)
    >>> xy_px.round(3)
    array([[3.167, 2.   ]])
    """
    size = 2 * radius_px + 1
    dilated = cv2.dilate(space, np.ones((size, size), np.uint8), borderType=cv2.BORDER_REPLICATE)
    top = (space == dilated) & (space > min_score)
    top[[0, -1]] = top[:, [0, -1]] = False
    v, u = np.divmod(np.flatnonzero(top), top.shape[1])  # several times faster than np.nonzero in 2D
    order = np.argsort(-space[v, u], kind="stable")[:max_peaks]
    v, u = v[order], u[order]
    centre = space[v, u].astype(np.float64)
    du = _vertex(space[v, u - 1], centre, space[v, u + 1])
    dv = _vertex(space[v - 1, u], centre, space[v + 1, u])
    return np.stack([u + du, v + dv], axis=1), centre


def _vertex(before: Floating, centre: Floating, after: Floating) -> Floating:
    """Return the positions (n,) of the vertices of parabolas through values at -1, 0 and 1, within half a pixel."""
    curvature = before + after - 2 * centre
    shift = 0.5 * (before - after) / np.where(curvature < 0, curvature, -np.inf)
    return np.clip(shift, -0.5, 0.5)
