"""Curves and measures of a spine at a stage, each with its standard deviation, 95% interval and status."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.curves import find_curves
from spinewatch.spine.evaluation import (
    Evaluation,
    MeasureRequest,
    bracketed_levels,
    curve_requests,
    evaluate,
    held_reason,
    spine_requests,
)
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.plane_vector import deviations_from_zero, direction_interval, length_interval
from spinewatch.spine.reselection import (
    ReselectionWindow,
    candidates_without_pose,
    reselected_ends,
    reselection_windows,
)
from spinewatch.spine.results import Curve, MeasuredSpine, MeasureStatus, MeasureValue
from spinewatch.spine.uncertainty import common_factors, normal_interval


def measure_spine(
    configuration: SpineConfiguration,
    baseline: SpineConfiguration,
    parameters: MeasureParameters | None = None,
) -> MeasuredSpine:
    """Return the curves of a spine and its measures at a stage.

    Parameters
    ----------
    configuration
        The spine at the stage.
    baseline
        The spine at the baseline stage, which decides curves and vertebrae; for the baseline itself the same object.
    parameters
        Numbers of the method; None for the defaults.

    Returns
    -------
    MeasuredSpine
        Curves of the baseline and measures of the stage: those of each curve, cranial first, then those of the whole
        spine. What cannot be measured is there with a reason.

    References
    ----------
    `definitions.DEFINITIONS`. Deviations are of first order in the errors of the poses.
    """
    parameters = parameters or MeasureParameters()
    curves = find_curves(baseline, parameters)
    (factor,) = common_factors((configuration,))
    bracketed = bracketed_levels(configuration)

    def measured(request: MeasureRequest) -> MeasureValue:
        held = None if configuration is baseline else held_reason(request, configuration)
        if held is not None:
            return not_measured(request, held, assumed=configuration.assumed)
        found = evaluate(request, configuration, factor, bracketed)
        return stage_value(request, found, assumed=configuration.assumed, parameters=parameters)

    measures: list[MeasureValue] = []
    for curve, window in zip(curves, reselection_windows(baseline, curves), strict=True):
        request, found = evaluate_reselected(curve, window, configuration, factor, bracketed, parameters)
        again = stage_value(request, found, assumed=configuration.assumed, parameters=parameters)
        first, *others = curve_requests(curve)
        measures += [measured(first), again, *map(measured, others)]
    if not curves:
        reason = "fewer than three vertebrae have a pose at the baseline stage, too few for a curve"
        measures.append(
            not_measured(MeasureRequest("cobb-fixed", None, ()), reason, assumed=configuration.assumed)
        )
    measures += map(measured, spine_requests(baseline, parameters))
    return MeasuredSpine(curves, tuple(measures))


def stage_value(
    request: MeasureRequest, found: Evaluation, *, assumed: bool, parameters: MeasureParameters
) -> MeasureValue:
    """Return a measure with its interval.

    Parameters
    ----------
    request
        The measure.
    found
        Its value at a stage.
    assumed
        Whether the initial configuration is assumed.
    parameters
        Limit of the plane of maximum curvature.

    Returns
    -------
    MeasureValue
        The measure; not measured if it is a plane that the errors leave undetermined.
    """
    if found.status is MeasureStatus.NOT_MEASURED:
        return not_measured(request, found.reason or "", assumed=assumed)
    reason = plane_reason(request, found, parameters)
    if reason is not None:
        return not_measured(request, reason, assumed=assumed)
    lower, upper = interval_of(request, found)
    return MeasureValue(
        definition=request.definition,
        curve=request.curve,
        levels=request.levels,
        value=found.value,
        sd=found.sd,
        lower=lower,
        upper=upper,
        status=found.status,
        assumed=assumed,
        reason=found.reason,
    )


def interval_of(request: MeasureRequest, found: Evaluation) -> tuple[float, float]:
    """Return the 95% interval of a measure.

    Parameters
    ----------
    request
        The measure.
    found
        Its value at a stage.

    Returns
    -------
    tuple of float
        Lower and upper end, widened to the values of other interpolations.
    """
    if found.vector is None:
        return normal_interval(found.values, found.sd)
    if request.definition == "angle-3d":
        return length_interval(found.vector)
    return direction_interval(found.values, found.vector)


def plane_reason(request: MeasureRequest, found: Evaluation, parameters: MeasureParameters) -> str | None:
    """Return why a plane of maximum curvature is not determined; None if it is, and for every other measure.

    Parameters
    ----------
    request
        The measure.
    found
        Its value at a stage.
    parameters
        Largest standard deviation of the plane.

    Returns
    -------
    str or None
        A clause with the numbers.

    References
    ----------
    The vector whose direction is the plane must be as many of its standard deviations long, by its full covariance,
    as a vector whose direction has the largest deviation, if errors are alike in all directions. The deviation across
    the measured vector alone is no measure: where errors differ by direction, they swing the vector to the axis of the
    larger ones, across which the smaller ones are left.
    """
    if request.definition != "plane-of-maximum-curvature" or found.vector is None:
        return None
    sd_deg = float(np.degrees(1.0 / max(deviations_from_zero(found.vector), 1e-9)))
    if sd_deg <= parameters.max_azimuth_sd_deg:
        return None
    return (
        f"{request.levels[0]} and {request.levels[-1]} are so nearly parallel that their plane is known to"
        f" {min(sd_deg, 180.0):.0f} degrees only; {parameters.max_azimuth_sd_deg:g} are needed"
    )


def not_measured(request: MeasureRequest, reason: str, *, assumed: bool) -> MeasureValue:
    """Return a measure without a value.

    Parameters
    ----------
    request
        The measure.
    reason
        Why it is not measured.
    assumed
        Whether the initial configuration is assumed.

    Returns
    -------
    MeasureValue
        The measure with NaN for its numbers.
    """
    nan = float("nan")
    return MeasureValue(
        definition=request.definition,
        curve=request.curve,
        levels=request.levels,
        value=nan,
        sd=nan,
        lower=nan,
        upper=nan,
        status=MeasureStatus.NOT_MEASURED,
        assumed=assumed,
        reason=reason,
    )


def evaluate_reselected(
    curve: Curve,
    window: ReselectionWindow,
    configuration: SpineConfiguration,
    factor: Float,
    bracketed: frozenset[str],
    parameters: MeasureParameters,
) -> tuple[MeasureRequest, Evaluation]:
    """Return the Cobb angle of a curve at the most tilted vertebrae of a stage.

    Parameters
    ----------
    curve
        The curve of the baseline.
    window
        Candidates for its end vertebrae.
    configuration
        The spine at the stage.
    factor
        Its error factors side by side, as of `uncertainty.common_factors`.
    bracketed
        Vertebrae that are only bracketed, as of `evaluation.bracketed_levels`.
    parameters
        Numbers of the method.

    Returns
    -------
    request : MeasureRequest
        The measure with the vertebrae that were selected.
    found : Evaluation
        The angle; bracketed also if a candidate has no pose, or no marker and may be tilted more, and if the side of
        the convexity is not known.
    """
    ends = reselected_ends(configuration, factor, bracketed, window, parameters)
    levels = (ends.upper, ends.lower) if ends else (curve.upper, curve.lower)
    request = MeasureRequest("cobb-reselected", curve.name, levels)
    found = evaluate(request, configuration, factor, bracketed)
    if ends is None or found.status is MeasureStatus.NOT_MEASURED:
        return request, found
    found = replace(found, own_sd=ends.selection_sd_deg)
    reasons = [found.reason] if found.reason else []
    if ends.rivals:
        have = "has no marker at this stage" if len(ends.rivals) == 1 else "have no marker at this stage"
        reasons.append(f"{', '.join(ends.rivals)} {have} and may be tilted more")
        found = replace(found, values=np.append(found.values, found.value + ends.excess_deg))
    if ends.opposite is not None:
        other = evaluate(replace(request, levels=ends.opposite), configuration, factor, bracketed)
        reasons.append(
            f"the side that the curve is convex to is not known, and {' and '.join(ends.opposite)} may be its ends"
        )
        found = replace(found, values=np.append(found.values, other.values))
    absent = candidates_without_pose(configuration, window)
    if absent:
        reasons.append(
            f"{', '.join(absent)} {'was' if len(absent) == 1 else 'were'} not measured and took no part"
        )
    if not reasons:
        return request, found
    return request, replace(found, status=MeasureStatus.BRACKETED, reason="; ".join(reasons))
