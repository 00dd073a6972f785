"""Which of several centres in an image are those of the same ball."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from spinewatch.arrays import Bool, Float, Int
from spinewatch.detection.features import HIDDEN


def nearest(positions: Float, others: Float, radius: float) -> Int:
    """Return the nearest of other positions to each position.

    Parameters
    ----------
    positions
        Positions, shape (n, 2).
    others
        Other positions, shape (m, 2).
    radius
        Greatest distance.

    Returns
    -------
    Int
        Indices of the others, shape (n,); `HIDDEN` where none is within the radius.

    Examples
    --------
    >>> nearest(np.array([[0.0, 0.0], [9.0, 9.0]]), np.array([[5.0, 5.0], [0.0, 0.3]]), 0.4).tolist()
    [1, -1]
    """
    if not len(others) or not len(positions):
        return np.full(len(positions), HIDDEN)
    distance, index = cKDTree(others).query(positions)
    return np.where(distance <= radius, index, HIDDEN)


def without_duplicates(positions: Float, radius: float) -> Int:
    """Return the positions that are farther than a radius from every retained earlier one.

    Parameters
    ----------
    positions
        Positions, shape (n, 2), those to be preferred first.
    radius
        Distance within which positions are the same.

    Returns
    -------
    Int
        Indices of the retained ones, ascending.

    Examples
    --------
    >>> without_duplicates(np.array([[0.0, 0.0], [0.3, 0.0], [0.6, 0.0]]), 0.4).tolist()
    [0, 2]
    """
    kept = np.ones(len(positions), dtype=bool)
    for first, later in sorted(cKDTree(positions).query_pairs(radius)):
        kept[later] &= not kept[first]
    return np.flatnonzero(kept)


def same_ball(xy_px: Float, others_px: Float, radius_px: Float, merge_radius: float) -> Bool:
    """Return which centres are those of the same ball as other centres.

    Parameters
    ----------
    xy_px
        Centres (u, v), shape (n, 2), px.
    others_px
        Other centres (u, v), shape (m, 2), px.
    radius_px
        Radii of a ball along u and v, shape (2,), px.
    merge_radius
        Centres that are closer than this are of the same ball, radii.

    Returns
    -------
    Bool
        Whether a centre and another are of the same ball, shape (n, m).

    Examples
    --------
    >>> centres = np.array([[10.0, 20.0], [30.0, 20.0]])
    >>> same_ball(centres, np.array([[31.0, 20.0]]), np.array([5.0, 6.0]), 0.4).tolist()
    [[False], [True]]
    """
    return np.asarray(np.linalg.norm((xy_px[:, None] - others_px) / radius_px, axis=-1) < merge_radius)
