"""Everything that is reported of the spine at one stage: configuration, measures, changes, what remains, and doubts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from spinewatch.flags import Flag
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.spine.bodies import object_to_spine
from spinewatch.spine.comparison import compare_stages
from spinewatch.spine.configuration import SpineConfiguration, SpineSetup
from spinewatch.spine.interpolation_model import InterpolationParameters
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.measures import measure_spine
from spinewatch.spine.plausibility import PlausibilityParameters, plausibility_flags
from spinewatch.spine.rebaseline_checks import RebaselineParameters, rebaseline_flags
from spinewatch.spine.results import MeasuredSpine, MeasureValue, SpineChange
from spinewatch.spine.stage_spine import spine_at_stage
from spinewatch.spine.target import PlannedVertebra, RemainingMotion, remaining_motion, target_measures
from spinewatch.spine.vertebra_measures import vertebra_measures
from spinewatch.triads.pose import Pose

Stages = Mapping[str, Mapping[str, Pose]]
"""Labelled poses by stage, in the order of the surgery; each in object space of its stage."""


@dataclass(frozen=True)
class SpineParameters:
    """All numbers of the method.

    Attributes
    ----------
    interpolation
        Interpolation of the vertebrae without a marker.
    measures
        Curves, measures and their changes.
    plausibility
        Limits of plausible motion.
    rebaselines
        How still a spine must be while a marker is clamped again.
    """

    interpolation: InterpolationParameters = field(default_factory=InterpolationParameters)
    measures: MeasureParameters = field(default_factory=MeasureParameters)
    plausibility: PlausibilityParameters = field(default_factory=PlausibilityParameters)
    rebaselines: RebaselineParameters = field(default_factory=RebaselineParameters)


@dataclass(frozen=True, eq=False)
class StageAssessment:
    """The spine at one stage.

    Attributes
    ----------
    configuration
        Poses of the vertebrae.
    object_to_spine
        From object space of the stage to the frame of the poses.
    measured
        Curves of the baseline stage, and measures of this one.
    vertebrae
        Tilts, axial rotation and lateral displacement of every vertebra, cranial first.
    since_baseline
        Change since the baseline stage; None for that stage itself.
    since_previous
        Change since the stage before; None for the first one.
    remaining
        What remains to the target per vertebra; None without a target.
    target_measures
        Measures of the target less those of this stage; None without a target.
    flags
        Doubts about markers that were clamped again, and about the motion since the stage before.
    """

    configuration: SpineConfiguration
    object_to_spine: RigidTransform
    measured: MeasuredSpine
    vertebrae: tuple[MeasureValue, ...]
    since_baseline: SpineChange | None
    since_previous: SpineChange | None
    remaining: tuple[RemainingMotion, ...] | None
    target_measures: tuple[MeasureValue, ...] | None
    flags: tuple[Flag, ...]


def assess_stage(
    setup: SpineSetup,
    stages: Stages,
    stage: str,
    previous: str | None = None,
    target: Sequence[PlannedVertebra] | None = None,
    parameters: SpineParameters | None = None,
) -> StageAssessment:
    """Return everything that is reported of the spine at one stage.

    Parameters
    ----------
    setup
        What is known of the surgery.
    stages
        Labelled poses by stage, in the order of the surgery: the baseline, this stage, the stage before, and the stages
        of rebaselines.
    stage
        Name of the stage.
    previous
        Name of the stage before; None for the first one.
    target
        Planned poses of vertebrae; None without a plan.
    parameters
        All numbers of the method.

    Returns
    -------
    StageAssessment
        The spine.

    Raises
    ------
    SpinewatchError
        If a stage or the reference triad is missing.
    """
    p = parameters or SpineParameters()
    names = dict.fromkeys(name for name in (setup.baseline, stage, previous) if name is not None)
    spines = {name: spine_at_stage(setup, stages, name, p.interpolation) for name in names}
    baseline, now = spines[setup.baseline], spines[stage]

    def since(earlier: str | None) -> SpineChange | None:
        if earlier is None or earlier == stage:
            return None
        return compare_stages(spines[earlier], now, baseline, setup.reference, p.measures)

    since_baseline = since(setup.baseline)
    return StageAssessment(
        configuration=now,
        object_to_spine=object_to_spine(setup, stages, stage),
        measured=measure_spine(now, baseline, p.measures),
        vertebrae=vertebra_measures(now, p.measures),
        since_baseline=since_baseline,
        since_previous=since_baseline if previous == setup.baseline else since(previous),
        remaining=None if target is None else remaining_motion(now, target, setup.reference),
        target_measures=None
        if target is None
        else target_measures(now, baseline, target, setup.reference, p.measures),
        flags=(
            *rebaseline_flags(setup, stages, stage, p.rebaselines),
            *_flags(setup, stages, stage, previous, p.plausibility),
        ),
    )


def _flags(
    setup: SpineSetup,
    stages: Stages,
    stage: str,
    previous: str | None,
    parameters: PlausibilityParameters,
) -> tuple[Flag, ...]:
    """Return flags of the motion since the stage before; a marker that was clamped again in between says nothing."""
    if previous is None:
        return ()
    order = tuple(stages)
    clamped = {item.vertebra for item in setup.rebaselines if item.overlaps(order, previous, stage)}
    before, after = (
        {name: pose for name, pose in stages[at].items() if name not in clamped} for at in (previous, stage)
    )
    return plausibility_flags(before, after, setup.reference, setup.extra_levels, parameters)
