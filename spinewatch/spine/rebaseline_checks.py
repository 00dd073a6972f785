"""Whether nothing moved between the stages that a marker was clamped again between, as the other triads show it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.flags import Flag
from spinewatch.spine.configuration import Rebaseline, SpineSetup
from spinewatch.spine.motion import relative_motion
from spinewatch.spine.plausibility import shared_motion
from spinewatch.spine.radiograph_fit import chi2_p_value
from spinewatch.triads.pose import Pose


@dataclass(frozen=True)
class RebaselineParameters:
    """How still a spine must be while a marker is clamped again.

    Attributes
    ----------
    settling_mm, settling_deg
        Standard deviation of the motion of a triad while nothing is done to the spine, per axis, mm and degrees:
        breathing that is left, and tissue that gives way where a hand works beside it.
    significance
        Probability of the motion of the others below which it is doubtful, for a spine that only settles.
    """

    settling_mm: float = 0.7
    settling_deg: float = 0.7
    significance: float = 1e-3


def rebaseline_flags(
    setup: SpineSetup,
    stages: Mapping[str, Mapping[str, Pose]],
    stage: str,
    parameters: RebaselineParameters | None = None,
) -> tuple[Flag, ...]:
    """Return flags of markers clamped again, across which the poses of a stage are counted from the baseline.

    What a vertebra moved between the two stages of a rebaseline is lost, for all stages beyond. The triads that stayed
    in place, the reference among them, show whether the spine moved: they must have moved as one body.

    Parameters
    ----------
    setup
        What is known of the surgery.
    stages
        Labelled poses by stage, in the order of the surgery; those of rebaselines are among them.
    stage
        Name of the stage.
    parameters
        Limits; the default ones if None.

    Returns
    -------
    tuple of Flag
        ``rebaseline-moved`` where the others moved among each other, ``rebaseline-unchecked`` where no other triad
        besides the reference shows it.
    """
    p = parameters or RebaselineParameters()
    order = tuple(stages)
    return tuple(
        flag
        for rebaseline in setup.rebaselines
        if rebaseline.within(order, setup.baseline, stage)
        for flag in _flags(rebaseline, setup, stages, order, p)
    )


def _flags(
    rebaseline: Rebaseline,
    setup: SpineSetup,
    stages: Mapping[str, Mapping[str, Pose]],
    order: Sequence[str],
    p: RebaselineParameters,
) -> Iterator[Flag]:
    before, after = stages[rebaseline.before], stages[rebaseline.after]
    if not {rebaseline.vertebra, setup.reference} <= before.keys() & after.keys():
        return
    clamped = {
        item.vertebra
        for item in setup.rebaselines
        if item.overlaps(order, rebaseline.before, rebaseline.after)
    }
    stayed = [name for name in before if name in after and name not in clamped]
    what = f"{rebaseline.vertebra} was clamped again between {rebaseline.before} and {rebaseline.after}"
    if len(stayed) < 2:
        yield Flag(
            "rebaseline-unchecked",
            f"{what}, and no triad besides that of the reference {setup.reference} shows whether the spine moved;"
            " make sure that nothing was done to it in between",
        )
        return
    start = {name: before[name] for name in stayed}
    end = {name: after[name] for name in stayed}
    settled = np.diag([p.settling_mm**2] * 3 + [p.settling_deg**2] * 3)
    loose = [Pose(pose.position_mm, pose.rotation, pose.covariance + settled) for pose in end.values()]
    dof = 6 * (len(stayed) - 1)
    chi2 = dof * shared_motion(list(start.values()), loose).reduced_chi_square
    if chi2_p_value(chi2, dof) >= p.significance:
        return
    motions = relative_motion(start, end, setup.reference)
    most = max(motions, key=lambda motion: motion.angle_deg)
    yield Flag(
        "rebaseline-moved",
        f"{what}, but the spine moved: {most.vertebra} by {np.linalg.norm(most.translation_mm):.1f} mm and"
        f" {most.angle_deg:.1f} degrees against the reference {setup.reference}, and what"
        f" {rebaseline.vertebra} moved is"
        " lost; name two stages between which nothing was done, or use a new baseline",
    )
