"""Labels of triads by their order along the spine; an uncertain label is null with a reason, never a guess."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from math import comb

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.flags import Flag
from spinewatch.levels import level_numbers, vertebra_names
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.triads.known_configuration import (
    Assignment,
    KnownConfiguration,
    configuration_likelihood,
    known_problem,
    rotation_sigmas,
)
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.pose import DOUBTFUL, MeasuredTriad
from spinewatch.triads.spacing import implausible_spacing
from spinewatch.triads.spine_order import axis_problem, in_order


@dataclass(frozen=True, eq=False)
class LabelledTriad:
    """A triad with its vertebra.

    Attributes
    ----------
    label
        Vertebra; None if it is not certain.
    label_reason
        Why there is no label; None if there is one.
    triad
        The measured triad.
    """

    label: str | None
    label_reason: str | None
    triad: MeasuredTriad


def label_triads(
    triads: Sequence[MeasuredTriad],
    labels: Sequence[str],
    axis: SpineAxis = "auto",
    parameters: LabelParameters | None = None,
    known: KnownConfiguration | None = None,
    extra_levels: Sequence[str] = (),
) -> tuple[tuple[LabelledTriad, ...], tuple[Flag, ...]]:
    """Return the triads in order along the spine axis with their labels.

    As many triads as labels are labelled by order. If triads are missing, these decide, in this order: kinds of
    markers, the known configuration (H4), and the evenness of gaps. Evenness alone gives no labels if a triad at an end
    may be missing. No triad is labelled if there are more triads than labels, if they do not lie along the spine axis,
    or if their distances contradict the labels. A doubtful triad has no label. The others are labelled without it; if
    that gives no labels, with it in its place, unless it is more likely false than not.

    Parameters
    ----------
    triads
        Measured triads.
    labels
        Vertebrae in order of increasing coordinate along the axis, in anatomical order.
    axis
        Object axis along which the spine extends; "auto" is that of greatest extent.
    parameters
        How labels are assigned and checked; the default ones if None.
    known
        Known configuration, if any.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones, for example T13 or L6.

    Returns
    -------
    triads : tuple of LabelledTriad
        The triads in order along the axis; those that are not doubtful are all labelled or none.
    flags : tuple of Flag
        "labels-uncertain" if there are triads and labels but no assignment, "levels-implausible" if their distances
        contradict it, "spine-axis-implausible" if the triads do not lie along the axis.

    Raises
    ------
    LevelError
        If the labels are not names of vertebrae in order.

    References
    ----------
    Thesis section 5.7, which labels by order and needs all triads.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.triads.pose import Pose
    >>> at = lambda x: MeasuredTriad("flat", {}, Pose(np.array([x, 0, 0]), np.eye(3), np.zeros((6, 6))), 0.0)
    >>> labelled, _ = label_triads([at(151.0), at(0.0), at(98.0)], ["L1", "T11", "T9", "T7"])
    >>> [triad.label for triad in labelled]
    ['L1', 'T9', 'T7']
    """
    p, known = parameters or LabelParameters(), known or KnownConfiguration()
    names = vertebra_names(labels, extra_levels)
    certain = [triad for triad in triads if not triad.doubtful]
    placed = [triad for triad in triads if not triad.doubtful or _keeps_its_place(triad, p)]
    labelled, flags = _labelled(in_order(certain, axis), names, axis, p, known, extra_levels)
    if len(placed) > len(certain) > 0 and labelled[0].label is None:
        with_doubtful, no_flags = _labelled(in_order(placed, axis), names, axis, p, known, extra_levels)
        if with_doubtful[0].label is not None:
            labelled, flags = with_doubtful, no_flags
    of_triad = {id(each.triad): each for each in labelled if not each.triad.doubtful}
    return tuple(
        of_triad.get(id(triad), LabelledTriad(None, DOUBTFUL, triad)) for triad in in_order(triads, axis)
    ), flags


def _keeps_its_place(doubtful: MeasuredTriad, p: LabelParameters) -> bool:
    return doubtful.chance_false is not None and doubtful.chance_false <= p.max_chance_false


def _labelled(
    ordered: list[MeasuredTriad],
    names: tuple[str, ...],
    axis: SpineAxis,
    p: LabelParameters,
    known: KnownConfiguration,
    extra_levels: Sequence[str],
) -> tuple[tuple[LabelledTriad, ...], tuple[Flag, ...]]:
    """Return triads in order along the axis with their labels, all or none, and flags."""
    positions_mm = np.array([triad.position_mm for triad in ordered])
    if problem := axis_problem(positions_mm, axis, p.max_axis_angle_deg, p.min_axis_margin_deg):
        return _unlabelled(ordered, problem), (Flag("spine-axis-implausible", problem),)
    assignment, reason = _assign(ordered, names, np.array(level_numbers(names, extra_levels)), p, known)
    if assignment is None:
        flags = (Flag("labels-uncertain", reason),) if reason and ordered and names else ()
        return _unlabelled(ordered, reason), flags
    problem = known_problem(assignment, ordered, names, p, known)
    if problem := problem or spacing_problem(assignment, ordered, names, extra_levels, p, known):
        return _unlabelled(ordered, problem), (Flag("levels-implausible", problem),)
    labelled = zip(assignment, ordered, strict=True)
    return tuple(LabelledTriad(names[k], None, triad) for k, triad in labelled), ()


def _unlabelled(ordered: Sequence[MeasuredTriad], reason: str | None) -> tuple[LabelledTriad, ...]:
    """Return triads without labels."""
    return tuple(LabelledTriad(None, reason, triad) for triad in ordered)


def spacing_problem(
    assignment: Assignment,
    ordered: Sequence[MeasuredTriad],
    labels: Sequence[str],
    extra_levels: Sequence[str],
    p: LabelParameters,
    known: KnownConfiguration,
) -> str | None:
    """Return what contradicts an assignment in the distances between triads with a pose.

    A known configuration that the distances fit takes precedence: vertebrae may be fused, compressed or absent.

    Parameters
    ----------
    assignment
        Index of the label of each triad.
    ordered
        Triads in order along the spine.
    labels
        Vertebrae in anatomical order.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    p
        Limits.
    known
        Known configuration; an empty one if there is none.

    Returns
    -------
    str or None
        Sentence with the distances; None if nothing contradicts the assignment.
    """
    if known.covers(labels) and len(ordered) > 1:
        likelihood = configuration_likelihood(assignment, ordered, labels, p, known)
        if likelihood >= -0.5 * p.max_sigma**2 * (len(ordered) - 1):
            return None
    posed = [i for i, triad in enumerate(ordered) if triad.pose is not None]
    if len(posed) < 2:
        return None
    numbers = np.array(level_numbers([labels[assignment[i]] for i in posed], extra_levels))
    problem = implausible_spacing(
        np.stack([ordered[i].position_mm for i in posed]), numbers, extra_levels, p.spacing
    )
    return f"{problem}; check the names of the vertebrae" if problem else None


def _assign(
    ordered: list[MeasuredTriad],
    labels: Sequence[str],
    numbers: Int,
    p: LabelParameters,
    known: KnownConfiguration,
) -> tuple[Assignment | None, str | None]:
    """Return the assignment of labels to triads in order, or None and the reason."""
    found, expected = len(ordered), len(labels)
    if not labels:
        return None, "no labels were given"
    if found > expected:
        return None, f"{found} triads were found for {expected} labels"
    if comb(expected, found) > p.max_assignments:
        return None, _too_few(found, expected)
    possible = [a for a in combinations(range(expected), found) if _markers_agree(a, ordered, labels, known)]
    if not possible:
        return None, "the kinds of markers that were found are not in the order of the labels"
    if len(possible) == 1:
        return possible[0], None
    return _most_likely(possible, ordered, labels, numbers, p, known)


def _most_likely(
    possible: Sequence[Assignment],
    ordered: list[MeasuredTriad],
    labels: Sequence[str],
    numbers: Int,
    p: LabelParameters,
    known: KnownConfiguration,
) -> tuple[Assignment | None, str | None]:
    """Return the assignment that the known configuration, or else the evenness of gaps, makes most likely."""
    found, expected = len(ordered), len(labels)
    if found < 2:
        return None, _too_few(found, expected)
    if known.covers(labels):
        likelihood = np.array([configuration_likelihood(a, ordered, labels, p, known) for a in possible])
        if likelihood.max() < -0.5 * p.max_sigma**2 * (found - 1):
            return None, "the triads that were found do not fit the known configuration"
        basis = "the known configuration does not determine which"
    else:
        P = np.stack([t.position_mm for t in ordered])
        gaps = np.linalg.norm(np.diff(P, axis=0), axis=1)
        levels = np.abs(numbers - numbers[0]).astype(np.float64)
        likelihood = np.array([_gap_likelihood(gaps, levels[list(a)], p.spacing_sd) for a in possible])
        basis = "the gaps between the others do not determine which"
    best, second = np.argsort(-likelihood, kind="stable")[:2]
    # A marker that was clamped again changes its rotation relative to all others, but not that between two of these.
    turned = rotation_sigmas(combinations(zip(possible[best], ordered, strict=True), 2), labels, p, known)
    if len(turned) > 1 and min(turned) >= p.max_rotation_sigma:
        return None, "the rotations between the triads that were found do not fit the known configuration"
    if likelihood[best] - likelihood[second] < np.log(p.min_likelihood_ratio):
        return None, f"{expected - found} of {expected} triads are missing, and {basis}"
    return possible[best], None


def _too_few(found: int, expected: int) -> str:
    """Return the reason for no label when almost every assignment is possible."""
    return f"only {found} of {expected} triads were found, too few to determine which"


def _markers_agree(
    assignment: Assignment, ordered: list[MeasuredTriad], labels: Sequence[str], known: KnownConfiguration
) -> bool:
    """Return whether every triad has the marker that is known for its label."""
    return all(
        known.markers.get(labels[k], triad.model) == triad.model
        for k, triad in zip(assignment, ordered, strict=True)
    )


def _gap_likelihood(gaps_mm: Float, level: Float, sd: float) -> float:
    """Return the log-likelihood of gaps (n - 1,) proportional to the steps between levels (n,), with free spacing."""
    steps = np.array([b - a for a, b in pairwise(level)])
    spread = sd / np.sqrt(steps / steps.min())
    log_spacing = np.log(gaps_mm / steps)
    mean = (log_spacing / spread**2).sum() / (1 / spread**2).sum()
    return float(-0.5 * (((log_spacing - mean) / spread) ** 2).sum() - np.log(spread).sum())
