"""The thesis's heuristics H1 to H3 and H5 on feature pairs (section 5.6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

FeaturePair = tuple[int, int]
"""Indices of a left and a right feature: a point."""

Verdict = Literal["P", "H1", "H2", "H3"]
"""Passed, or the heuristic that discards a triplet, as the tables print it."""


@dataclass(frozen=True)
class TripletFeatures:
    """A triplet as in Tables 5.4 to 5.6.

    Attributes
    ----------
    error_mm
        Error of its distance matrix (eq. 5.17), mm.
    pairs
        Left and right features of XX, YY and MX.
    """

    error_mm: float
    pairs: tuple[FeaturePair, FeaturePair, FeaturePair]


@dataclass(frozen=True)
class PublishedSelection:
    """Result of the published selection.

    Attributes
    ----------
    verdicts
        Verdict on each triplet.
    complete
        Whether as many triplets passed as markers were placed (H5).
    """

    verdicts: tuple[Verdict, ...]
    complete: bool


def h1_distinct(triplet: TripletFeatures) -> bool:
    """Return whether the balls of a triplet have different features in both images (H1).

    Parameters
    ----------
    triplet
        A triplet.

    Returns
    -------
    bool
        Whether its three left features are distinct, and its three right features.
    """
    left, right = zip(*triplet.pairs, strict=True)
    return len(set(left)) == len(set(right)) == 3


def h2_shared_point(a: TripletFeatures, b: TripletFeatures) -> bool:
    """Return whether two triplets have a point, that is a feature pair, in common (H2).

    Parameters
    ----------
    a, b
        Two triplets.

    Returns
    -------
    bool
        Whether they share a point.
    """
    return not set(a.pairs).isdisjoint(b.pairs)


def h3_shared_feature(a: TripletFeatures, b: TripletFeatures) -> bool:
    """Return whether two triplets have a feature of an image in common (H3).

    Parameters
    ----------
    a, b
        Two triplets.

    Returns
    -------
    bool
        Whether they share a left or a right feature.
    """
    return any(
        not set(x).isdisjoint(y)
        for x, y in zip(zip(*a.pairs, strict=True), zip(*b.pairs, strict=True), strict=True)
    )


def h5_complete(found: int, expected: int) -> bool:
    """Return whether as many triads were found as markers were placed (H5).

    Parameters
    ----------
    found
        Number of triads found.
    expected
        Number of markers placed.

    Returns
    -------
    bool
        Whether they are equal.
    """
    return found == expected


def published_selection(triplets: Sequence[TripletFeatures], expected: int) -> PublishedSelection:
    """Return the verdicts of the published heuristics.

    H1 is applied to all triplets, then H2 among those that remain, then H3; of two rivals the one with the smaller
    error stays (eq. 5.18). This order reproduces the tables; strictly in the printed order of the triplets, true triads
    would be discarded.

    Parameters
    ----------
    triplets
        Triplets within the tolerance of eq. 5.16.
    expected
        Number of markers placed.

    Returns
    -------
    PublishedSelection
        Verdicts in the order of the triplets, and whether H5 holds.

    References
    ----------
    Thesis section 5.6, eq. 5.18 and Tables 5.4 to 5.6.

    Examples
    --------
    >>> first = TripletFeatures(0.5, ((1, 1), (2, 2), (3, 3)))
    >>> rival = TripletFeatures(0.9, ((3, 3), (4, 4), (5, 5)))
    >>> published_selection([first, rival], expected=1)
    PublishedSelection(verdicts=('P', 'H2'), complete=True)
    """
    verdicts: list[Verdict] = ["P" if h1_distinct(t) else "H1" for t in triplets]
    _discard_rivals(triplets, verdicts, "H2", h2_shared_point)
    _discard_rivals(triplets, verdicts, "H3", h3_shared_feature)
    return PublishedSelection(tuple(verdicts), h5_complete(verdicts.count("P"), expected))


def _discard_rivals(
    triplets: Sequence[TripletFeatures],
    verdicts: list[Verdict],
    heuristic: Verdict,
    are_rivals: Callable[[TripletFeatures, TripletFeatures], bool],
) -> None:
    """Change the verdict on triplets that have a rival of smaller error."""
    kept: list[int] = []
    passed = [i for i, verdict in enumerate(verdicts) if verdict == "P"]
    for i in sorted(passed, key=lambda i: triplets[i].error_mm):
        if any(are_rivals(triplets[i], triplets[k]) for k in kept):
            verdicts[i] = heuristic
        else:
            kept.append(i)
