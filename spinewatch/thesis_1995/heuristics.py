"""The thesis's heuristics H1 to H3 and H5 as pure functions on feature pairs (section 5.6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

FeaturePair = tuple[int, int]


@dataclass(frozen=True)
class TripletFeatures:
    """A triplet as in Tables 5.4 to 5.6: ``error_mm`` and the (left, right) features of XX, YY and MX."""

    error_mm: float
    pairs: tuple[FeaturePair, FeaturePair, FeaturePair]


def h1_distinct(triplet: TripletFeatures) -> bool:
    """Return whether the three left features are distinct and the three right features are (H1)."""
    left, right = zip(*triplet.pairs, strict=True)
    return len(set(left)) == len(set(right)) == 3


def h2_shared_point(a: TripletFeatures, b: TripletFeatures) -> bool:
    """Return whether two triplets have a 3D point, i.e. a feature pair, in common (H2)."""
    return not set(a.pairs).isdisjoint(b.pairs)


def h3_shared_feature(a: TripletFeatures, b: TripletFeatures) -> bool:
    """Return whether two triplets use the same feature of an image (H3)."""
    return any(
        not set(x).isdisjoint(y)
        for x, y in zip(zip(*a.pairs, strict=True), zip(*b.pairs, strict=True), strict=True)
    )


def h5_complete(found: int, expected: int) -> bool:
    """Return whether as many triads were found as markers were placed (H5)."""
    return found == expected


def published_strategy(triplets: Sequence[TripletFeatures]) -> tuple[str, ...]:
    """Return for each triplet "P" or the heuristic that discards it: "H1", "H2" or "H3".

    H1 for all triplets, then H2 among those left, then H3, the least error winning each time (eq. 5.18).
    Examined strictly in the printed order true triads would be lost. Triplets that pass are kept in their
    order.
    """
    verdict = ["P" if h1_distinct(t) else "H1" for t in triplets]
    for name, rivals in (("H2", h2_shared_point), ("H3", h3_shared_feature)):
        _discard_rivals(triplets, verdict, name, rivals)
    return tuple(verdict)


def _discard_rivals(
    triplets: Sequence[TripletFeatures],
    verdict: list[str],
    name: str,
    rivals: Callable[[TripletFeatures, TripletFeatures], bool],
) -> None:
    kept: list[int] = []
    alive = [i for i, v in enumerate(verdict) if v == "P"]
    for i in sorted(alive, key=lambda i: triplets[i].error_mm):
        if any(rivals(triplets[i], triplets[k]) for k in kept):
            verdict[i] = name
        else:
            kept.append(i)
