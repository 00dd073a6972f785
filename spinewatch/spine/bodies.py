"""Bodies of the vertebrae that carry a triad, by the chain from their initial poses; NumPy only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.covariance import covariance_factor
from spinewatch.geometry.kinematic_chain import Link, chain_poses
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.spine.axes_errors import axes_factor, turning
from spinewatch.spine.configuration import SpinePoses, SpineSetup
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.spine.sequence import sequence_with
from spinewatch.triads.pose import Pose

INITIAL = "initial"
"""Name of the source of the initial configuration's errors."""

AXES = "patient axes"
"""Name of the source of the errors of the patient axes; setups with exact axes do not have it."""

Stages = Mapping[str, Mapping[str, Pose]]
"""Labelled poses by stage, in the order of the surgery; each in object space of its stage."""


class StageMissingError(ParameterError):
    """A stage that the spine needs was not given."""

    code = "stage-missing"


class RebaselineError(ParameterError):
    """A re-clamped marker that cannot be taken into account."""

    code = "invalid-rebaseline"


@dataclass(frozen=True, eq=False)
class Bodies:
    """Bodies of the marked vertebrae at one stage, patient axes.

    Attributes
    ----------
    levels
        Names of the n vertebrae from cranial to caudal: all between the ends of the initial configuration, and those
        with a marker beyond at any of the stages.
    initial
        Initial poses; NaN where it has none.
    initial_errors
        Errors of the initial poses by source; zero where there is none.
    marked
        Which of them are measured at this stage, shape (n,), bool.
    poses
        Their poses; NaN for the others.
    errors
        Errors of the measured poses by source; zero for the others.
    reasons
        Why a vertebra is not measured; None where it is.
    """

    levels: tuple[str, ...]
    initial: SpinePoses
    initial_errors: Mapping[str, Float]
    marked: Bool
    poses: SpinePoses
    errors: Mapping[str, Float]
    reasons: tuple[str | None, ...]


def triads_source(stage: str) -> str:
    """Return the name of the source of the errors of a stage's triads.

    Parameters
    ----------
    stage
        Name of the stage.

    Returns
    -------
    str
        ``triads NAME``.
    """
    return f"triads {stage}"


def measured_bodies(setup: SpineSetup, stages: Stages, stage: str) -> Bodies:
    """Return the bodies of the vertebrae that carry a triad at a stage.

    Parameters
    ----------
    setup
        What is known of the surgery.
    stages
        Labelled poses by stage, in the order of the surgery: the baseline, this stage, and the stages of rebaselines.
        Stages that are to be compared need the same ones: a triad at any of them makes its vertebra one of the spine.
    stage
        Name of the stage.

    Returns
    -------
    Bodies
        The measured bodies with their errors; at the baseline those of all marked vertebrae are their initial poses.

    Raises
    ------
    StageMissingError
        If a stage is missing.
    ReferenceMissingError
        If the reference was not measured at the baseline or at this stage.
    RebaselineError
        If the reference's marker was re-clamped, or the stages of a rebaseline are not in order.

    References
    ----------
    ``B_i^k = P^-1 X_D^0 (X_D^k)^-1 X_i^k (X_i^0)^-1 B_i^0``: the vertebra follows its triad as a rigid body, in the
    frame of the reference triad D. A re-clamped marker adds ``(X_i^b)^-1 X_D^b (X_D^a)^-1 X_i^a`` after ``X_i^k``, with
    its last stage a in the former place and its first stage b in the new one. Replaces thesis eq. 6.1.
    """
    order = _checked_order(setup, stages, stage)
    levels = _levels(setup, stages)
    initial, initial_errors = _initial_poses(setup, stages, levels)
    reference = setup.reference
    paths = {name: () if name == reference else _path(name, setup, order, stage) for name in levels}
    reasons = tuple(_obstacle(name, paths[name], setup, stages, stage) for name in levels)
    marked = np.array([reason is None for reason in reasons])
    position, rotation = np.full_like(initial.position_mm, np.nan), np.full_like(initial.rotation, np.nan)
    errors = {source: np.zeros_like(factor) for source, factor in initial_errors.items()}
    to_patient = RigidTransform(setup.patient_axes, _origin_mm(setup, stages)).inverse()
    to_object = to_patient.inverse()
    for path in dict.fromkeys(paths.values()):
        rows = [i for i, name in enumerate(levels) if marked[i] and paths[name] == path]
        if not rows:
            continue
        links = _links([levels[i] for i in rows], path or (), setup, stages)
        result = chain_poses(
            [_fixed(to_patient, len(rows)), *(link for link, _ in links), _fixed(to_object, len(rows))],
            initial.position_mm[rows],
            initial.rotation[rows],
        )
        position[rows], rotation[rows] = result.position_mm, result.rotation
        for source, factor in initial_errors.items():
            errors[source][rows] = result.by_last @ factor[rows]
        for (_, triads), J in zip(links, result.by_link[1:-1], strict=True):
            _add_errors(errors, J, rows, len(levels), triads, stages)
    initial_errors, errors = (
        _with_axes(own, placed, setup)
        for own, placed in ((initial_errors, initial.position_mm), (errors, position))
    )
    return Bodies(levels, initial, initial_errors, marked, SpinePoses(position, rotation), errors, reasons)


def object_to_spine(setup: SpineSetup, stages: Stages, stage: str) -> RigidTransform:
    """Return the transform from object space of a stage to the frame of the spine.

    Parameters
    ----------
    setup
        What is known of the surgery.
    stages
        Labelled poses by stage, in the order of the surgery: the baseline, this stage, and the stages of rebaselines.
    stage
        Name of the stage.

    Returns
    -------
    RigidTransform
        ``P^-1 X_D^0 (X_D^k)^-1``: it takes what the cameras saw at the stage to where `measured_bodies` has the bodies.

    Raises
    ------
    StageMissingError
        If a stage is missing.
    ReferenceMissingError
        If the reference was not measured at the baseline or at this stage.
    RebaselineError
        If the reference's marker was re-clamped, or the stages of a rebaseline are not in order.
    """
    _checked_order(setup, stages, stage)
    patient = RigidTransform(setup.patient_axes, _origin_mm(setup, stages))
    first, now = (stages[name][setup.reference] for name in (setup.baseline, stage))
    at_baseline = RigidTransform(first.rotation, first.position_mm)
    return patient.inverse() @ at_baseline @ RigidTransform(now.rotation, now.position_mm).inverse()


def _checked_order(setup: SpineSetup, stages: Stages, stage: str) -> tuple[str, ...]:
    """Return the names of the stages in order after checking that they suffice."""
    order = tuple(stages)
    needed = [setup.baseline, stage]
    for rebaseline in setup.rebaselines:
        needed += [rebaseline.before, rebaseline.after]
    for name in needed:
        if name not in stages:
            raise StageMissingError(
                f"stage {name} is not among the stages given; give it, in the order of the surgery"
            )
    for name in (setup.baseline, stage):
        if setup.reference not in stages[name]:
            raise ReferenceMissingError(
                f"reference {setup.reference} was not measured at stage {name}; take that stage again or use another"
                " reference"
            )
    for rebaseline in setup.rebaselines:
        if rebaseline.vertebra == setup.reference:
            raise RebaselineError(
                f"the marker of the reference {setup.reference} was clamped again, so that no common frame is left; use"
                " another reference, or a new baseline from that stage on"
            )
        if order.index(rebaseline.before) >= order.index(rebaseline.after):
            raise RebaselineError(
                f"re-clamped marker {rebaseline.vertebra}: stage {rebaseline.before} is not before"
                f" {rebaseline.after}; name the last stage in the former place first"
            )
    return order


def _levels(setup: SpineSetup, stages: Stages) -> tuple[str, ...]:
    """Return the vertebrae between the ends of the initial configuration, and those with a marker beyond, downwards.

    Those of all stages, so that every stage has the same.
    """
    named = {*setup.initial.levels, *(name for poses in stages.values() for name in poses)}
    sequence = sequence_with({*named, *setup.extra_levels})
    numbers = [sequence.index(name) for name in setup.initial.levels]
    return tuple(
        name for i, name in enumerate(sequence) if min(numbers) <= i <= max(numbers) or name in named
    )


def _origin_mm(setup: SpineSetup, stages: Stages) -> Float:
    """Return the origin of the patient frame: the reference's initial centroid or else its triad's P, object space."""
    if setup.reference in setup.initial.levels:
        return np.asarray(setup.initial.position_mm[setup.initial.levels.index(setup.reference)])
    return stages[setup.baseline][setup.reference].position_mm


def _initial_poses(
    setup: SpineSetup, stages: Stages, levels: tuple[str, ...]
) -> tuple[SpinePoses, dict[str, Float]]:
    """Return the initial poses in patient axes, NaN where there is none, and the errors of their places by source.

    They have errors of their own, and those of the patient axes where they were given in them.
    """
    n = len(levels)
    rows = [levels.index(name) for name in setup.initial.levels]
    to_patient = setup.patient_axes.T
    position, rotation = np.full((n, 3), np.nan), np.full((n, 3, 3), np.nan)
    position[rows] = (setup.initial.position_mm - _origin_mm(setup, stages)) @ to_patient.T
    rotation[rows] = to_patient @ setup.initial.rotation
    given = {INITIAL: setup.initial.errors}
    factor = axes_factor(setup.axes_covariance_deg2)
    if factor.shape[1]:
        by_axes = setup.initial.by_axes
        given[AXES] = (np.zeros((len(rows), 6, 3)) if by_axes is None else by_axes) @ factor
    errors = {source: np.zeros((n, 6, own.shape[2])) for source, own in given.items()}
    for source, own in given.items():
        errors[source][rows, :3] = to_patient @ own[:, :3]
        errors[source][rows, 3:] = to_patient @ own[:, 3:]
    return SpinePoses(position, rotation), errors


def _with_axes(errors: dict[str, Float], position_mm: Float, setup: SpineSetup) -> dict[str, Float]:
    """Return errors (n, 6, r) by source with those of the axes that poses are seen in: turned by e, they turn by -e."""
    if AXES not in errors:
        return errors
    turned = turning(position_mm) @ axes_factor(setup.axes_covariance_deg2)
    return errors | {AXES: errors[AXES] - turned}


def _path(name: str, setup: SpineSetup, order: tuple[str, ...], stage: str) -> tuple[str, ...] | None:
    """Return the stages whose triads lead from a stage to the baseline, or None while the marker is re-clamped.

    The stage comes first and the baseline last; between them is a pair of stages for each re-clamping in between, which
    the spine did not move across. At the baseline itself the path is empty.
    """
    if stage == setup.baseline:
        return ()
    now, first = order.index(stage), order.index(setup.baseline)
    between: list[tuple[int, str, str]] = []
    for rebaseline in setup.rebaselines:
        before, after = order.index(rebaseline.before), order.index(rebaseline.after)
        if rebaseline.vertebra != name:
            continue
        if before < now < after or before < first < after:
            return None
        if not rebaseline.within(order, setup.baseline, stage):
            continue
        if first < now:
            between.append((-before, rebaseline.after, rebaseline.before))
        else:
            between.append((before, rebaseline.before, rebaseline.after))
    middle = [name for _, *pair in sorted(between) for name in pair]
    return (stage, *middle, setup.baseline)


def _obstacle(
    name: str, path: tuple[str, ...] | None, setup: SpineSetup, stages: Stages, stage: str
) -> str | None:
    """Return why a vertebra is not measured at a stage, or None."""
    if name not in stages[setup.baseline]:
        if any(name in poses for poses in stages.values()):
            return f"its triad was not measured at the baseline {setup.baseline}"
        return "it carries no triad"
    if name not in setup.initial.levels:
        return "the initial configuration has no pose of it"
    if path is None:
        return "its marker was being clamped again"
    for at in path:
        for who, words in (
            (name, "its triad"),
            (setup.reference, f"the triad of the reference {setup.reference}"),
        ):
            if who not in stages[at]:
                return f"{words} was not measured at stage {at}"
    return None


def _links(
    names: list[str], path: tuple[str, ...], setup: SpineSetup, stages: Stages
) -> list[tuple[Link, list[tuple[str, str]]]]:
    """Return the links of a path for vertebrae, each with the (stage, vertebra) of its triads."""
    if not path:
        return []
    references = [setup.reference] * len(names)
    steps = [(setup.baseline, references, False)]
    for number, at in enumerate(path):
        own, of_reference = (at, names), (at, references)
        # From the reference to the vertebra, and from there back to the reference at the next stage.
        steps += (
            [(*own, True), (*of_reference, False)] if number % 2 else [(*of_reference, True), (*own, False)]
        )
    # The reference at the baseline ends the path as its inverse began it.
    return [_link(stages[at], owners, at, inverted) for at, owners, inverted in steps[:-1]]


def _link(
    poses: Mapping[str, Pose], owners: list[str], at: str, inverted: bool
) -> tuple[Link, list[tuple[str, str]]]:
    """Return a link of the poses of triads at a stage."""
    position = np.array([poses[owner].position_mm for owner in owners])
    rotation = np.array([poses[owner].rotation for owner in owners])
    return Link(position, rotation, inverted), [(at, owner) for owner in owners]


def _fixed(transform: RigidTransform, n: int) -> Link:
    """Return a link that is the same for all and without error."""
    return Link(np.tile(transform.translation_mm, (n, 1)), np.tile(transform.rotation, (n, 1, 1)))


def _add_errors(
    errors: dict[str, Float],
    J: Float,
    rows: list[int],
    n: int,
    triads: list[tuple[str, str]],
    stages: Stages,
) -> None:
    """Add the errors of triads of one stage to those of bodies; its source has six columns for each of its triads."""
    at = triads[0][0]
    columns = {who: 6 * i for i, who in enumerate(sorted(stages[at]))}
    F = J @ covariance_factor(np.array([stages[at][who].covariance for _, who in triads]))
    source = errors.setdefault(triads_source(at), np.zeros((n, 6, 6 * len(columns))))
    for (_, who), row, block in zip(triads, rows, F, strict=True):
        source[row, :, columns[who] : columns[who] + 6] += block
