"""The configuration of the spine at one stage: measured bodies by their triads, the others by interpolation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.spine.assembly import assemble
from spinewatch.spine.configuration import InitialKind, Origin, SpineConfiguration, SpinePoses, SpineSetup
from spinewatch.spine.displacements import Base, fill_positions, is_known
from spinewatch.spine.interpolation import fill_rotations, other_interpolations
from spinewatch.spine.interpolation_model import InterpolationParameters
from spinewatch.triads.pose import Pose


def spine_at_stage(
    setup: SpineSetup,
    stages: Mapping[str, Mapping[str, Pose]],
    stage: str,
    parameters: InterpolationParameters | None = None,
) -> SpineConfiguration:
    """Return the configuration of the spine at a stage.

    Parameters
    ----------
    setup
        What is known of the surgery.
    stages
        Labelled poses of triads by stage, in the order of the surgery: the baseline, this stage, and the stages of the
        rebaselines; each in object space of its stage. Stages that are to be compared need the same ones.
    stage
        Name of the stage.
    parameters
        Size of the errors of interpolation; the default ones if None.

    Returns
    -------
    SpineConfiguration
        Poses in patient axes with errors, origins and reasons. At the baseline the initial poses hold for every
        vertebra, those of a generic spine between the outermost measured ones; at another stage a vertebra without a
        triad is interpolated if it lies between measured ones.

    Raises
    ------
    StageMissingError
        If a stage is missing.
    ReferenceMissingError
        If the reference was not measured at the baseline or at this stage.
    RebaselineError
        If the reference's marker was re-clamped, or the stages of a rebaseline are not in order.
    BodiesCoincideError
        If two bodies of the initial configuration coincide.

    References
    ----------
    The chain is that of `measured_bodies`. Between measured vertebrae the change since the baseline is interpolated, so
    that no motion gives the initial configuration: a natural cubic spline of the displacement and a RotationSpline of
    the rotation. A vertebra that the initial configuration has no pose of is first interpolated there.
    """
    parameters = parameters or InterpolationParameters()
    assembled = assemble(setup, stages, stage, _fill, parameters)
    assumed = setup.initial.kind is InitialKind.GENERIC
    bodies, known = assembled.bodies, assembled.known
    filled = _within(assembled.filled, bodies.marked) if assumed else assembled.filled
    origins = _origins(known, filled, assumed)
    return SpineConfiguration(
        levels=bodies.levels,
        marked=tuple(bool(m) for m in bodies.marked),
        origins=origins,
        reasons=tuple(
            f"{reason}, and it is not between vertebrae that were measured"
            if origin is Origin.NOT_MEASURED
            else None
            for origin, reason in zip(origins, bodies.reasons, strict=True)
        ),
        poses=filled,
        errors=assembled.errors,
        alternatives=other_interpolations(known, filled, assembled.base),
        assumed=assumed,
        reference=setup.reference,
    )


def _within(poses: SpinePoses, marked: Bool) -> SpinePoses:
    """Return poses without those beyond the outermost marked vertebrae: a generic spine is fitted to their triads."""
    rows = np.flatnonzero(marked)
    beyond = np.ones(len(marked), dtype=bool)
    beyond[rows[0] : rows[-1] + 1] = False
    position, rotation = poses.position_mm.copy(), poses.rotation.copy()
    position[beyond], rotation[beyond] = np.nan, np.nan
    return SpinePoses(position, rotation)


def _fill(
    known: SpinePoses, errors: dict[str, Float], base: Base, source: str, parameters: InterpolationParameters
) -> SpinePoses:
    """Return known poses with those between them, whose errors are added."""
    return SpinePoses(
        fill_positions(known.position_mm, errors, base, source, parameters),
        fill_rotations(known.rotation, errors, base, source, parameters),
    )


def _origins(known: SpinePoses, filled: SpinePoses, assumed: bool) -> tuple[Origin, ...]:
    """Return where each pose comes from."""
    origins = []
    for measured, placed in zip(*(is_known(p.position_mm) for p in (known, filled)), strict=True):
        if not placed:
            origins.append(Origin.NOT_MEASURED)
        elif assumed:
            origins.append(Origin.ASSUMED)
        else:
            origins.append(Origin.MEASURED if measured else Origin.INTERPOLATED)
    return tuple(origins)
