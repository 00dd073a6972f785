"""Motion of the bodies of marked vertebrae between any two stages, in patient axes; NumPy only."""

from __future__ import annotations

from collections.abc import Mapping

from spinewatch.arrays import Float
from spinewatch.spine.assembly import assemble
from spinewatch.spine.bodies import Bodies
from spinewatch.spine.changes import vertebra_changes
from spinewatch.spine.configuration import InitialKind, Origin, SpineConfiguration, SpinePoses, SpineSetup
from spinewatch.spine.displacements import Base, fill_positions
from spinewatch.spine.interpolation_model import InterpolationParameters
from spinewatch.spine.results import VertebraChange
from spinewatch.triads.pose import Pose


def body_motion(
    setup: SpineSetup,
    stages: Mapping[str, Mapping[str, Pose]],
    start: str,
    end: str,
    parameters: InterpolationParameters | None = None,
) -> tuple[VertebraChange, ...]:
    """Return the motion of the bodies of the marked vertebrae from one stage to another.

    Parameters
    ----------
    setup
        What is known of the surgery.
    stages
        Labelled poses of triads by stage, in the order of the surgery: the baseline, both stages, and the stages of the
        rebaselines; each in object space of its stage.
    start, end
        Names of the two stages.
    parameters
        Size of the errors of interpolation; the default ones if None.

    Returns
    -------
    tuple of VertebraChange
        Those that `vertebra_changes` gives of the configurations at both stages, for the vertebrae whose triads both
        measured, the reference included; from cranial to caudal.

    Raises
    ------
    StageMissingError
        If a stage is missing.
    ReferenceMissingError
        If the reference was not measured at the baseline or at one of the stages.
    RebaselineError
        If the reference's marker was re-clamped, or the stages of a rebaseline are not in order.
    BodiesCoincideError
        If two bodies of the initial configuration coincide.
    """
    parameters = parameters or InterpolationParameters()
    before, after = (_configuration(setup, stages, stage, parameters) for stage in (start, end))
    both = {
        name for name, *marks in zip(before.levels, before.marked, after.marked, strict=True) if all(marks)
    }
    return tuple(
        change for change in vertebra_changes(before, after, setup.reference) if change.vertebra in both
    )


def _configuration(
    setup: SpineSetup,
    stages: Mapping[str, Mapping[str, Pose]],
    stage: str,
    parameters: InterpolationParameters,
) -> SpineConfiguration:
    """Return the measured bodies at a stage, with the positions between them, which lengths of the curve need."""
    assembled = assemble(setup, stages, stage, _fill, parameters)
    bodies = assembled.bodies
    return SpineConfiguration(
        bodies.levels,
        tuple(bool(m) for m in bodies.marked),
        _origins(bodies, setup.initial.kind is InitialKind.GENERIC),
        bodies.reasons,
        assembled.filled,
        assembled.errors,
    )


def _fill(
    known: SpinePoses, errors: dict[str, Float], base: Base, source: str, parameters: InterpolationParameters
) -> SpinePoses:
    """Return known poses with the positions between them, whose errors are added."""
    return SpinePoses(fill_positions(known.position_mm, errors, base, source, parameters), known.rotation)


def _origins(bodies: Bodies, assumed: bool) -> tuple[Origin, ...]:
    """Return where the pose of each vertebra comes from; only those of measured ones are used."""
    measured = Origin.ASSUMED if assumed else Origin.MEASURED
    return tuple(measured if marked else Origin.NOT_MEASURED for marked in bodies.marked)
