"""Triads that a person removed: they are not found again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.matching.triad_candidates import TriadCandidates

NEAR_MM = 10.0
"""Triads nearer to each other than this are the same one: half the smallest distance of two markers, mm."""

_SAME_PX = 1e-6
"""Distance below which a feature is the same as that of an earlier measurement, px."""


@dataclass(frozen=True, eq=False)
class RemovedTriad:
    """A triad that a person removed.

    Attributes
    ----------
    position_mm
        Where it was, shape (3,), object space, mm; None when that is not known.
    left_px, right_px
        Centres (u, v) of its balls in each image, shape (n, 2), px.
    """

    position_mm: Float | None
    left_px: Float
    right_px: Float


def removed_candidates(
    candidates: TriadCandidates, left: Features, right: Features, removed: Sequence[RemovedTriad]
) -> Bool:
    """Return which candidate triads a person removed.

    Parameters
    ----------
    candidates
        c candidate triads.
    left, right
        Features of the two images.
    removed
        Triads that were removed.

    Returns
    -------
    Bool
        Whether each candidate has no other ball image than those of a removed triad, or has most of them or is at its
        place without a centre that a person placed, shape (c,).

    Examples
    --------
    >>> features = Features.with_sigma(np.array([[1.0, 1], [2, 2], [3, 3], [4, 4]]), np.ones(4), 0.1)
    >>> index = np.array([[0, 1, 2, HIDDEN], [0, 2, 3, HIDDEN]])
    >>> none = np.zeros(2)
    >>> two = TriadCandidates(none, np.zeros((2, 3)), np.zeros((2, 3, 3)), none, index, index)
    >>> first = RemovedTriad(None, features.xy_px[:3], features.xy_px[:1])
    >>> removed_candidates(two, features, features, [first])
    array([ True, False])
    """
    found = np.zeros(len(candidates), dtype=bool)
    manual = _count(candidates.left, left.is_manual) + _count(candidates.right, right.is_manual) > 0
    images = (candidates.left != HIDDEN).sum(axis=1) + (candidates.right != HIDDEN).sum(axis=1)
    for triad in removed:
        shared = _count(candidates.left, _at(left, triad.left_px)) + _count(
            candidates.right, _at(right, triad.right_px)
        )
        same = 2 * shared > images
        if triad.position_mm is not None:
            same |= np.linalg.norm(candidates.origin_mm - triad.position_mm, axis=1) < NEAR_MM
        found |= (same & ~manual) | (shared == images)
    return found


def _at(features: Features, centres_px: Float) -> Bool:
    """Return whether features (f,) are at some of the centres (m, 2), shape (f,)."""
    distance = np.linalg.norm(features.xy_px[:, None] - np.reshape(centres_px, (-1, 2)), axis=-1)
    return np.asarray(np.any(distance < _SAME_PX, axis=1))


def _count(index: Int, wanted: Bool) -> Int:
    """Return how many of the features (c, n) are wanted, shape (c,)."""
    return np.asarray(((index != HIDDEN) & np.append(wanted, False)[index]).sum(axis=1))
