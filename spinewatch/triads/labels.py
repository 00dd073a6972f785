"""Labels of triads by their order along the spine; an uncertain one is null with a reason, never a guess."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise
from math import comb
from typing import Literal

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.triads.pose import MeasuredTriad, Pose

_REGIONS = {"C": 0, "T": 7, "L": 19, "S": 24}
_VERTEBRA = re.compile(r"([CTLS])(\d{1,2})")
_MOST_ASSIGNMENTS = 20_000
_LARGEST_TURN_SIGMA = 4.0  # a clamp may have been turned


@dataclass(frozen=True)
class LabelParameters:
    """How the row decides on labels when triads are missing.

    ``spacing_sd`` is the relative irregularity of the distance between neighbours, ``min_ratio`` how much
    likelier the best assignment must be than the next. Against a known configuration (H4): ``moved_sd_mm`` of
    a distance and ``turned_sd_deg`` of a rotation between neighbours since then; beyond ``max_sigma`` on
    average nothing agrees.
    """

    spacing_sd: float = 0.12
    min_ratio: float = 100.0
    moved_sd_mm: float = 3.0
    turned_sd_deg: float = 8.0
    max_sigma: float = 5.0


@dataclass(frozen=True, eq=False)
class KnownConfiguration:
    """What is known of the row before the picture is looked at, by label.

    ``poses`` of an earlier stage, in any one frame; ``distances_mm`` between pairs of vertebrae, from
    radiographs say, needed only where there is no pose; ``markers``, names of the models on the vertebrae
    when these are of several kinds.
    """

    poses: Mapping[str, Pose] = field(default_factory=dict)
    distances_mm: Mapping[tuple[str, str], float] = field(default_factory=dict)
    markers: Mapping[str, str] = field(default_factory=dict)

    def distance_mm(self, a: str, b: str) -> float | None:
        """Return the known distance between two vertebrae's triads, or None."""
        if a in self.poses and b in self.poses:
            return float(np.linalg.norm(self.poses[a].position_mm - self.poses[b].position_mm))
        return self.distances_mm.get((a, b), self.distances_mm.get((b, a)))

    def covers(self, labels: Sequence[str]) -> bool:
        """Return whether every distance along the row is known."""
        return all(self.distance_mm(a, b) is not None for a, b in combinations(labels, 2))


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
    known: KnownConfiguration | None = None,
) -> tuple[tuple[LabelledTriad, ...], tuple[Flag, ...]]:
    """Return the triads in order along the spine axis with their labels, and flags.

    ``labels`` are in order of increasing coordinate; "auto" takes the object axis of greatest extent. As many
    triads as labels are labelled by order, as the thesis does. With fewer, markers of different kinds decide
    if they can, then the known configuration (H4), and without one the gaps when they are even enough; then a
    triad missing at an end leaves no trace, so that no label is given.
    """
    ordered = in_order(triads, axis)
    chosen, reason = _assign(ordered, labels, parameters or LabelParameters(), known or KnownConfiguration())
    if chosen is None:
        unlabelled = tuple(LabelledTriad(None, reason, triad) for triad in ordered)
        flags = (Flag("labels-uncertain", reason),) if reason and ordered and labels else ()
        return unlabelled, flags
    return tuple(LabelledTriad(labels[k], None, triad) for k, triad in zip(chosen, ordered, strict=True)), ()


def in_order(triads: Sequence[MeasuredTriad], axis: Literal["x", "y", "auto"]) -> list[MeasuredTriad]:
    """Return triads by increasing coordinate of P along the spine axis."""
    if not triads:
        return []
    P = np.stack([t.place_mm for t in triads])[:, :2]
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


def _assign(
    ordered: list[MeasuredTriad], labels: Sequence[str], p: LabelParameters, known: KnownConfiguration
) -> tuple[tuple[int, ...] | None, str | None]:
    """Return the places of the triads in ``labels``, or None and why they cannot be told."""
    found, expected = len(ordered), len(labels)
    if not labels:
        return None, "no labels were given"
    if found > expected:
        return None, f"{found} triads were found for {expected} labels"
    if comb(expected, found) > _MOST_ASSIGNMENTS:
        return None, f"only {found} of {expected} triads were found, too few to tell which"
    possible = [a for a in combinations(range(expected), found) if _markers_agree(a, ordered, labels, known)]
    if not possible:
        return None, "the kinds of markers that were found are not in the order of the labels"
    if len(possible) == 1:
        return possible[0], None
    return _likeliest(possible, ordered, labels, p, known)


def _likeliest(
    possible: Sequence[tuple[int, ...]],
    ordered: list[MeasuredTriad],
    labels: Sequence[str],
    p: LabelParameters,
    known: KnownConfiguration,
) -> tuple[tuple[int, ...] | None, str | None]:
    """Return the possible places that the known configuration, or else the evenness of gaps, makes likeliest."""
    found, expected = len(ordered), len(labels)
    if found < 2:
        return None, f"only {found} of {expected} triads were found, too few to tell which"
    if known.covers(labels):
        likelihood = np.array([_agreement(a, ordered, labels, p, known) for a in possible])
        if likelihood.max() < -0.5 * p.max_sigma**2 * (found - 1):
            return None, "the triads that were found are not where the known configuration has any"
        basis = "the known configuration does not tell which"
    else:
        P = np.stack([t.place_mm for t in ordered])
        gaps = np.linalg.norm(np.diff(P, axis=0), axis=1)
        likelihood = np.array([_evenness(gaps, levels(labels)[list(a)], p.spacing_sd) for a in possible])
        basis = "the gaps between the others do not tell which"
    best, second = np.argsort(-likelihood, kind="stable")[:2]
    if likelihood[best] - likelihood[second] < np.log(p.min_ratio):
        return None, f"{expected - found} of {expected} triads missing, and {basis}"
    return possible[best], None


def _markers_agree(
    places: Sequence[int], ordered: list[MeasuredTriad], labels: Sequence[str], known: KnownConfiguration
) -> bool:
    return all(
        known.markers.get(labels[k], triad.model) == triad.model
        for k, triad in zip(places, ordered, strict=True)
    )


def _agreement(
    places: Sequence[int],
    ordered: list[MeasuredTriad],
    labels: Sequence[str],
    p: LabelParameters,
    known: KnownConfiguration,
) -> float:
    """Return the log-likelihood, but for a constant, of neighbours' distances and rotations as known (H4)."""
    total = 0.0
    for (i, a), (j, b) in pairwise(zip(places, ordered, strict=True)):
        distance = known.distance_mm(labels[i], labels[j]) or 0.0
        off = float(np.linalg.norm(a.place_mm - b.place_mm)) - distance
        total -= 0.5 * (off / p.moved_sd_mm) ** 2
        before = known.poses.get(labels[i]), known.poses.get(labels[j])
        if before[0] and before[1] and a.pose and b.pose:
            change = (a.pose.rotation.T @ b.pose.rotation).T @ (before[0].rotation.T @ before[1].rotation)
            angle = float(np.degrees(np.linalg.norm(vector_from_rotation(change))))
            total -= 0.5 * min(angle / p.turned_sd_deg, _LARGEST_TURN_SIGMA) ** 2
    return total


def _evenness(gaps: Float, places: Float, sd: float) -> float:
    """Return the log-likelihood of gaps proportional to the steps between places, the factor being free."""
    steps = np.array([b - a for a, b in pairwise(places)])
    spread = sd / np.sqrt(steps / steps.min())
    off = np.log(gaps / steps)
    mean = (off / spread**2).sum() / (1 / spread**2).sum()
    return float(-0.5 * (((off - mean) / spread) ** 2).sum() - np.log(spread).sum())
