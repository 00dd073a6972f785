"""Candidate triads: features that may be the images of one marker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.detection.features import HIDDEN

MAX_BALLS = 4
"""Largest number of balls of a marker: columns of the feature indices of candidates."""


@dataclass(frozen=True, eq=False)
class TriadCandidates:
    """c candidate triads that face the cameras.

    Attributes
    ----------
    model
        Indices of their markers, shape (c,).
    origin_mm
        Approximate origins, shape (c, 3), object space, mm.
    rotation
        Approximate rotations from marker to object axes, shape (c, 3, 3).
    log_odds
        Log-odds of each on its own, shape (c,).
    left, right
        Indices of features in the order of the model's balls, shape (c, 4); `HIDDEN` where an image does not show a
        ball or the marker has no fourth.
    """

    model: Int
    origin_mm: Float
    rotation: Float
    log_odds: Float
    left: Int
    right: Int

    def __len__(self) -> int:
        return len(self.model)

    def take(self, index: object) -> TriadCandidates:
        """Return a selection of the candidates.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        TriadCandidates
            The selected candidates, in the order of the index.
        """
        i = np.asarray(index)
        return TriadCandidates(*(getattr(self, f.name)[i] for f in fields(self)))

    @classmethod
    def empty(cls) -> TriadCandidates:
        """Return no candidates.

        Returns
        -------
        TriadCandidates
            Arrays of length 0.
        """
        none, features = np.empty(0, dtype=np.intp), np.empty((0, MAX_BALLS), dtype=np.intp)
        return cls(none, np.empty((0, 3)), np.empty((0, 3, 3)), np.empty(0), features, features)

    @classmethod
    def concatenate(cls, parts: Sequence[TriadCandidates]) -> TriadCandidates:
        """Return the candidates of several sets.

        Parameters
        ----------
        parts
            At least one set of candidates.

        Returns
        -------
        TriadCandidates
            All of them, in their order.
        """
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))


def share_features(candidates: TriadCandidates) -> Bool:
    """Return whether two candidates use the same feature of an image.

    Parameters
    ----------
    candidates
        c candidate triads.

    Returns
    -------
    Bool
        Whether two of them share a feature, shape (c, c).

    References
    ----------
    Heuristics H2 and H3 of thesis section 5.6.
    """
    shared = np.zeros((len(candidates), len(candidates)), dtype=bool)
    for features in (candidates.left, candidates.right):
        used = np.zeros((len(candidates), int(features.max(initial=0)) + 2), dtype=np.float32)
        np.put_along_axis(used, features + 1, 1.0, axis=1)
        used[:, 0] = 0.0  # column of HIDDEN
        shared |= used @ used.T > 0
    return shared


def pad_features(features: Int) -> Int:
    """Return feature indices with a column for each possible ball.

    Parameters
    ----------
    features
        Indices, shape (c, n).

    Returns
    -------
    Int
        Indices, shape (c, 4), with `HIDDEN` in the columns added.
    """
    return np.pad(features, ((0, 0), (0, MAX_BALLS - features.shape[1])), constant_values=HIDDEN)
