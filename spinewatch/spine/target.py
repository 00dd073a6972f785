"""What remains to a planned configuration of the spine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.spine.configuration import Origin, SpineConfiguration, SpinePoses
from spinewatch.spine.measure_changes import measure_changes
from spinewatch.spine.measure_functions import wrapped
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.orientation import rotation_from_tilts, tilt_gradients, tilts_of
from spinewatch.spine.results import MeasureValue
from spinewatch.spine.uncertainty import common_factors

MAX_TARGET_MM = 10_000.0
"""Greatest magnitude of a coordinate of a planned position, mm."""


class TargetError(ParameterError):
    """A planned configuration that is not one of this spine: unknown or repeated levels, or impossible numbers."""

    code = "invalid-target"


@dataclass(frozen=True, eq=False)
class PlannedVertebra:
    """The planned pose of a vertebra.

    Attributes
    ----------
    vertebra
        Its name.
    angles_deg
        Coronal tilt, sagittal tilt and axial rotation, shape (3,), degrees.
    position_mm
        Centroid from that of the reference vertebra, shape (3,), patient axes, mm; None if not planned.
    """

    vertebra: str
    angles_deg: Float
    position_mm: Float | None = None


@dataclass(frozen=True, eq=False)
class RemainingMotion:
    """What remains to the planned pose of a vertebra: the plan less what is.

    Attributes
    ----------
    vertebra
        Its name.
    angles_deg, angles_sd_deg
        Coronal tilt, sagittal tilt and axial rotation and their standard deviations, shape (3,), degrees; NaN where the
        vertebra was not measured.
    translation_mm, translation_sd_mm
        Translation and its standard deviations, shape (3,), patient axes, mm; NaN also where no position is planned.
    """

    vertebra: str
    angles_deg: Float
    angles_sd_deg: Float
    translation_mm: Float
    translation_sd_mm: Float


def check_target(target: Sequence[PlannedVertebra], levels: Sequence[str]) -> None:
    """Refuse a plan that is not one of this spine.

    Parameters
    ----------
    target
        The plan.
    levels
        Names of the vertebrae of the spine.

    Raises
    ------
    TargetError
        If it names no vertebra, a vertebra that the spine does not have, or one twice; or if a number is not finite, a
        tilt not below 90 degrees, an axial rotation beyond 90 degrees, or a position beyond `MAX_TARGET_MM`.
    """
    names = [planned.vertebra for planned in target]
    if not names:
        raise TargetError("the target names no vertebra; give the planned pose of at least one")
    unknown = [name for name in names if name not in levels]
    if unknown:
        raise TargetError(
            f"the target plans {', '.join(unknown)}, which this spine does not have (it has {', '.join(levels)});"
            " check that the target belongs to this patient"
        )
    repeated = sorted({name for name in names if names.count(name) > 1}, key=names.index)
    if repeated:
        raise TargetError(f"the target plans {', '.join(repeated)} more than once; give each vertebra once")
    for planned in target:
        numbers = [planned.angles_deg] + ([] if planned.position_mm is None else [planned.position_mm])
        if not np.isfinite(np.concatenate(numbers)).all():
            raise TargetError(
                f"the target of {planned.vertebra} has a number that is not finite; give numbers"
            )
        if np.max(np.abs(planned.angles_deg[:2])) >= 90:
            raise TargetError(
                f"the target of {planned.vertebra} has a tilt of {np.max(np.abs(planned.angles_deg[:2])):g} degrees;"
                " tilts are below 90"
            )
        if abs(planned.angles_deg[2]) > 90:
            raise TargetError(
                f"the target of {planned.vertebra} has an axial rotation of {planned.angles_deg[2]:g} degrees; it is"
                " from -90 to 90"
            )
        if planned.position_mm is not None and np.max(np.abs(planned.position_mm)) > MAX_TARGET_MM:
            raise TargetError(
                f"the target of {planned.vertebra} is beyond {MAX_TARGET_MM / 1000:g} m; give its centroid from the"
                " reference vertebra's centroid in mm"
            )


def remaining_motion(
    configuration: SpineConfiguration, target: Sequence[PlannedVertebra], reference: str
) -> tuple[RemainingMotion, ...]:
    """Return what remains to a plan, for each vertebra in it.

    Parameters
    ----------
    configuration
        The spine at a stage.
    target
        The plan.
    reference
        The reference vertebra, from whose centroid planned positions are counted.

    Returns
    -------
    tuple of RemainingMotion
        In the order of the plan.

    Raises
    ------
    TargetError
        If the plan is not one of this spine.
    """
    check_target(target, configuration.levels)
    (factor,) = common_factors((configuration,))
    origin, origin_factor = _origin(configuration, factor, reference)
    remaining = []
    for planned in target:
        i = configuration.index(planned.vertebra)
        R = configuration.poses.rotation[i]
        position = np.full(3, np.nan) if planned.position_mm is None else planned.position_mm
        translation = position + origin - configuration.poses.position_mm[i]
        angles = wrapped(planned.angles_deg - np.array(tilts_of(R)))
        angles_sd = np.linalg.norm(tilt_gradients(R) @ factor[i, 3:], axis=1)
        translation_sd = np.linalg.norm(factor[i, :3] - origin_factor, axis=1)
        remaining.append(
            RemainingMotion(
                planned.vertebra,
                angles,
                np.where(np.isnan(angles), np.nan, angles_sd),
                translation,
                np.where(np.isnan(translation), np.nan, translation_sd),
            )
        )
    return tuple(remaining)


def target_configuration(
    configuration: SpineConfiguration, target: Sequence[PlannedVertebra], reference: str
) -> SpineConfiguration:
    """Return a plan as a configuration of the spine, without errors.

    Parameters
    ----------
    configuration
        The spine at a stage.
    target
        The plan.
    reference
        The reference vertebra, from whose centroid planned positions are counted.

    Returns
    -------
    SpineConfiguration
        The planned poses in the frame of ``configuration``; NaN for what is not planned. The centroid of the reference
        vertebra stays where it is unless it is planned.

    Raises
    ------
    TargetError
        If the plan is not one of this spine.
    """
    check_target(target, configuration.levels)
    (factor,) = common_factors((configuration,))
    origin, origin_factor = _origin(configuration, factor, reference)
    n = len(configuration.levels)
    position, rotation = np.full((n, 3), np.nan), np.full((n, 3, 3), np.nan)
    if reference in configuration.levels:
        position[configuration.index(reference)] = origin
    planned_levels = {configuration.index(planned.vertebra): planned for planned in target}
    for i, planned in planned_levels.items():
        rotation[i] = rotation_from_tilts(*planned.angles_deg)
        if planned.position_mm is not None:
            position[i] = planned.position_mm + origin
    carried = np.zeros_like(factor)
    carried[:, :3] = origin_factor
    errors = {}
    start = 0
    for source, own in configuration.errors.items():
        errors[source] = carried[:, :, start : start + own.shape[2]]
        start += own.shape[2]
    return SpineConfiguration(
        levels=configuration.levels,
        marked=tuple(i in planned_levels for i in range(n)),
        origins=tuple(Origin.MEASURED if i in planned_levels else Origin.NOT_MEASURED for i in range(n)),
        reasons=tuple(
            "its position is not planned" if i in planned_levels else "it is not planned" for i in range(n)
        ),
        poses=SpinePoses(position, rotation),
        errors=errors,
        assumed=configuration.assumed,
        reference=configuration.reference,
    )


def target_measures(
    configuration: SpineConfiguration,
    baseline: SpineConfiguration,
    target: Sequence[PlannedVertebra],
    reference: str,
    parameters: MeasureParameters | None = None,
) -> tuple[MeasureValue, ...]:
    """Return the measures of a plan less those of a stage.

    Parameters
    ----------
    configuration, baseline
        The spine at the stage and at the baseline stage, which decides curves and vertebrae.
    target
        The plan.
    reference
        The reference vertebra.
    parameters
        Numbers of the measures; None for the defaults.

    Returns
    -------
    tuple of MeasureValue
        As `measure_changes.measure_changes` from the stage to the plan; not measured, with a reason, where the plan
        lacks a vertebra or its position.

    Raises
    ------
    TargetError
        If the plan is not one of this spine.
    """
    return measure_changes(
        configuration, target_configuration(configuration, target, reference), baseline, parameters
    )


def _origin(configuration: SpineConfiguration, factor: Float, reference: str) -> tuple[Float, Float]:
    """Return the centroid of the reference vertebra and its errors by source; NaN if it is not known."""
    if reference not in configuration.levels:
        return np.full(3, np.nan), np.zeros((3, factor.shape[2]))
    i = configuration.index(reference)
    return configuration.poses.position_mm[i], factor[i, :3]
