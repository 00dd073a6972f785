"""Labels of triads by their order along the spine; an uncertain one is null with a reason, never a guess."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from math import comb
from typing import Literal

import numpy as np

from spinewatch.camera import Float
from spinewatch.flags import Flag
from spinewatch.triads.pose import MeasuredTriad

_REGIONS = {"C": 0, "T": 7, "L": 19, "S": 24}
_VERTEBRA = re.compile(r"([CTLS])(\d{1,2})")
_MOST_ASSIGNMENTS = 20_000


@dataclass(frozen=True)
class LabelParameters:
    """How gaps decide on labels when triads are missing.

    ``spacing_sd`` is the relative irregularity of the distance between neighbours, ``least_ratio`` how much
    likelier the best assignment must be than the next.
    """

    spacing_sd: float = 0.12
    least_ratio: float = 100.0


@dataclass(frozen=True, eq=False)
class LabelledTriad:
    """A triad with its vertebra's ``label``, or None and the ``label_reason`` why it has none."""

    label: str | None
    label_reason: str | None
    triad: MeasuredTriad


def label_triads(
    triads: Sequence[MeasuredTriad],
    labels: Sequence[str],
    axis: Literal["x", "y", "auto"] = "auto",
    parameters: LabelParameters | None = None,
) -> tuple[tuple[LabelledTriad, ...], tuple[Flag, ...]]:
    """Return the triads in order along the spine axis with their labels, and flags.

    ``labels`` are in order of increasing coordinate; "auto" takes the object axis of greatest extent. As many
    triads as labels are labelled by order, as the thesis does. With fewer, the gaps tell which label is
    missing inside the row when they are even enough to decide; a triad missing at an end leaves no trace, so
    that no label is given.
    """
    ordered = in_order(triads, axis)
    chosen = tuple(range(len(labels))) if len(labels) == len(ordered) else None
    reason = None
    if chosen is None:
        chosen, reason = _by_gaps(ordered, labels, parameters or LabelParameters())
    if chosen is None:
        unlabelled = tuple(LabelledTriad(None, reason, triad) for triad in ordered)
        flags = (Flag("labels-uncertain", reason),) if reason and ordered and labels else ()
        return unlabelled, flags
    return tuple(LabelledTriad(labels[k], None, triad) for k, triad in zip(chosen, ordered, strict=True)), ()


def in_order(triads: Sequence[MeasuredTriad], axis: Literal["x", "y", "auto"]) -> list[MeasuredTriad]:
    """Return triads by increasing coordinate of P along the spine axis."""
    if not triads:
        return []
    P = np.stack([t.pose.position_mm for t in triads])[:, :2]
    along = int(np.argmax(np.ptp(P, axis=0))) if axis == "auto" else "xy".index(axis)
    return [triads[i] for i in np.argsort(P[:, along], kind="stable")]


def levels(labels: Sequence[str]) -> Float:
    """Return the places (n,) of labels along the spine, counted in vertebrae; 0, 1, 2... for other names."""
    matches = [_VERTEBRA.fullmatch(label.strip().upper()) for label in labels]
    places = np.array([_REGIONS[m[1]] + int(m[2]) if m else 0 for m in matches], dtype=np.float64)
    steps = np.diff(places)
    if all(matches) and (np.all(steps > 0) or np.all(steps < 0)):
        return np.asarray(np.abs(places - places[0]))
    return np.arange(len(labels), dtype=np.float64)


def _by_gaps(
    ordered: list[MeasuredTriad], labels: Sequence[str], p: LabelParameters
) -> tuple[tuple[int, ...] | None, str | None]:
    found, expected = len(ordered), len(labels)
    if not labels:
        return None, "no labels were given"
    if found > expected:
        return None, f"{found} triads were found for {expected} labels"
    if found < 2 or comb(expected, found) > _MOST_ASSIGNMENTS:
        return None, f"only {found} of {expected} triads were found, too few to tell which"
    P = np.stack([t.pose.position_mm for t in ordered])
    gaps = np.linalg.norm(np.diff(P, axis=0), axis=1)
    assignments = list(combinations(range(expected), found))
    likelihood = np.array([_evenness(gaps, levels(labels)[list(a)], p.spacing_sd) for a in assignments])
    best, second = np.argsort(-likelihood, kind="stable")[:2]
    if likelihood[best] - likelihood[second] < np.log(p.least_ratio):
        missing = expected - found
        return (
            None,
            f"{missing} of {expected} triads missing, and the gaps between the others do not tell which",
        )
    return assignments[best], None


def _evenness(gaps: Float, places: Float, sd: float) -> float:
    """Return the log-likelihood of gaps proportional to the steps between places, the factor being free."""
    steps = np.array([b - a for a, b in pairwise(places)])
    spread = sd / np.sqrt(steps / steps.min())
    off = np.log(gaps / steps)
    mean = (off / spread**2).sum() / (1 / spread**2).sum()
    return float(-0.5 * (((off - mean) / spread) ** 2).sum() - np.log(spread).sum())
