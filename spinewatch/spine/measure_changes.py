"""Changes of the measures between two stages, with the errors that both share taken out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.curves import find_curves
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.evaluation import (
    Evaluation,
    MeasureRequest,
    bracketed_levels,
    curve_requests,
    evaluate,
    held_reason,
    spine_requests,
)
from spinewatch.spine.measure_functions import wrapped
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.measures import evaluate_reselected, interval_of, not_measured, plane_reason
from spinewatch.spine.reselection import reselection_windows
from spinewatch.spine.results import MeasureStatus, MeasureValue
from spinewatch.spine.uncertainty import QUANTILE_95, common_factors


def measure_changes(
    before: SpineConfiguration,
    after: SpineConfiguration,
    baseline: SpineConfiguration,
    parameters: MeasureParameters | None = None,
) -> tuple[MeasureValue, ...]:
    """Return the changes of the measures from one stage to another, later less earlier.

    Parameters
    ----------
    before, after
        The spine at the earlier and at the later stage.
    baseline
        The spine at the baseline stage, which decides curves and vertebrae.
    parameters
        Numbers of the method; None for the defaults.

    Returns
    -------
    tuple of MeasureValue
        Changes in the order of `measures.measure_spine`. The levels of a change of the re-selected Cobb angle are those
        of the later stage.

    References
    ----------
    To first order: the error of a change by each independent source is the error of the later value less that of the
    earlier one, so that what both stages share (the initial configuration, the baseline's triads) cancels as far as it
    does. Intervals of the 3-D angle and of the plane follow from those of both stages and their correlation: G. Y.
    Zou, "Toward using confidence intervals to compare correlations", Psychol. Methods 12 (2007) 399.
    """
    parameters = parameters or MeasureParameters()
    curves = find_curves(baseline, parameters)
    factors = common_factors((before, after))
    stages = (before, after)
    bracketed = tuple(bracketed_levels(stage) for stage in stages)
    assumed = before.assumed or after.assumed

    def changed(request: MeasureRequest) -> MeasureValue:
        held = held_reason(request, baseline)
        if held is not None:
            return not_measured(request, held, assumed=assumed)
        start, end = (
            evaluate(request, stage, factor, open_levels)
            for stage, factor, open_levels in zip(stages, factors, bracketed, strict=True)
        )
        return _change(request, start, end, assumed=assumed, parameters=parameters)

    changes: list[MeasureValue] = []
    for curve, window in zip(curves, reselection_windows(baseline, curves), strict=True):
        (_, start), (request, end) = (
            evaluate_reselected(curve, window, stage, factor, open_levels, parameters)
            for stage, factor, open_levels in zip(stages, factors, bracketed, strict=True)
        )
        again = _change(request, start, end, assumed=assumed, parameters=parameters)
        first, *others = curve_requests(curve)
        changes += [changed(first), again, *map(changed, others)]
    changes += map(changed, spine_requests(baseline, parameters))
    return tuple(changes)


def _change(
    request: MeasureRequest,
    before: Evaluation,
    after: Evaluation,
    *,
    assumed: bool,
    parameters: MeasureParameters,
) -> MeasureValue:
    """Return the change of a measure."""
    if request.reason is not None:
        return not_measured(request, request.reason, assumed=assumed)
    for name, found in (("earlier", before), ("later", after)):
        reason = found.reason if found.status is MeasureStatus.NOT_MEASURED else None
        reason = reason or plane_reason(request, found, parameters)
        if reason is not None:
            return not_measured(request, f"at the {name} stage {reason}", assumed=assumed)
    if request.definition == "cobb-reselected":
        differences = wrapped(np.subtract.outer(after.values, before.values).ravel())
    else:
        differences = _differences(before, after, angular=DEFINITIONS[request.definition].unit == "deg")
    sd = float(np.linalg.norm([*(after.errors - before.errors), after.own_sd, before.own_sd]))
    down = up = QUANTILE_95 * sd
    if request.definition in ("angle-3d", "plane-of-maximum-curvature"):
        down, up = _margins(request, before, after)
    open_stages = [found for found in (before, after) if found.status is MeasureStatus.BRACKETED]
    return MeasureValue(
        definition=request.definition,
        curve=request.curve,
        levels=request.levels,
        value=float(differences[0]),
        sd=sd,
        lower=float(np.min(differences)) - down,
        upper=float(np.max(differences)) + up,
        status=MeasureStatus.BRACKETED if open_stages else MeasureStatus.MEASURED,
        assumed=assumed,
        reason="; ".join(dict.fromkeys(found.reason or "" for found in open_stages)) or None,
    )


def _differences(before: Evaluation, after: Evaluation, *, angular: bool) -> np.ndarray:
    """Return the change and those of the other interpolations; a stage without one keeps its value."""
    size = max(len(before.values), len(after.values))
    start, end = (
        np.concatenate([found.values, np.full(size - len(found.values), found.value)])
        for found in (before, after)
    )
    return wrapped(end - start) if angular else end - start


def _margins(request: MeasureRequest, before: Evaluation, after: Evaluation) -> tuple[float, float]:
    """Return how far the interval of a change reaches below and above it, from the intervals of both stages."""
    single = [
        replace(
            found,
            values=found.values[:1],
            vector=found.vector and replace(found.vector, values=found.vector.values[:1]),
        )
        for found in (before, after)
    ]
    (b_low, b_up), (a_low, a_up) = (interval_of(request, found) for found in single)
    product = before.sd * after.sd
    correlation = float(before.errors @ after.errors) / product if product > 0 else 0.0

    def reach(one: float, other: float) -> float:
        return float(np.sqrt(max(one**2 + other**2 - 2 * correlation * one * other, 0.0)))

    return reach(after.value - a_low, b_up - before.value), reach(a_up - after.value, before.value - b_low)
