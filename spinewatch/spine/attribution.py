"""How much of a correction came with rotation and how much with distraction, per curve and per vertebra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.spine.changes import LevelsDifferError
from spinewatch.spine.configuration import SpineConfiguration, SpinePoses
from spinewatch.spine.curve_attribution import cobb_shares
from spinewatch.spine.curves import find_curves
from spinewatch.spine.evaluation import (
    Evaluation,
    MeasureRequest,
    bracketed_levels,
    evaluate,
    missing_reason,
    no_apex,
    no_marker,
)
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.measures import plane_reason
from spinewatch.spine.results import Attribution, Curve, MeasureStatus, Share
from spinewatch.spine.segment_attribution import displacement_shares, distraction_excess
from spinewatch.spine.uncertainty import common_factors, errors_of, gradient, normal_interval

_NAN = float("nan")
_UNKNOWN = Share(_NAN, _NAN, _NAN, _NAN)
_NOTHING = Share(0.0, 0.0, 0.0, 0.0)


def attribute(
    before: SpineConfiguration,
    after: SpineConfiguration,
    baseline: SpineConfiguration,
    reference: str,
    parameters: MeasureParameters | None = None,
) -> tuple[Attribution, ...]:
    """Return how much of what happened between two stages came with rotation and how much with distraction.

    Parameters
    ----------
    before, after
        The spine at the earlier and at the later stage, of the same setup.
    baseline
        The spine at the baseline stage, which decides the curves.
    reference
        The reference vertebra, from which displacements are counted.
    parameters
        Numbers of the method; None for the defaults.

    Returns
    -------
    tuple of Attribution
        For each curve the change of the Cobb angle and of the apical translation, then for each vertebra but the
        reference the change of its lateral displacement.

    Raises
    ------
    LevelsDifferError
        If the configurations are not of the same vertebrae.

    References
    ----------
    Cobb angle: `curve_attribution.cobb_shares`; its remainder is the part of the common tilt of the end vertebrae.
    Displacements: `segment_attribution.displacement_shares` along the vertebrae that are marked at both stages; their
    remainder is zero. Deviations are of first order, with the errors that both stages share; those of the parts of
    distraction are corrected by `segment_attribution.distraction_excess`.
    """
    if before.levels != after.levels:
        raise LevelsDifferError("the two stages have different vertebrae; compare stages of the same setup")
    parameters = parameters or MeasureParameters()
    curves = find_curves(baseline, parameters)
    of_vertebrae = _vertebrae(before, after, reference)
    by_name = {attribution.subject: attribution for attribution in of_vertebrae}
    attributions = []
    for curve in curves:
        apex = _apex(curve, by_name, reference, assumed=_assumed((before, after)))
        attributions += [_curve(curve, before, after, parameters), apex]
    return (*attributions, *of_vertebrae)


def _curve(
    curve: Curve, before: SpineConfiguration, after: SpineConfiguration, parameters: MeasureParameters
) -> Attribution:
    """Return the attribution of the change of a curve's Cobb angle."""
    stages = (before, after)
    ends = (curve.upper, curve.lower)
    assumed = _assumed(stages)
    for name, stage in zip(("earlier", "later"), stages, strict=True):
        reason = missing_reason(stage, ends, positions=False)
        if reason is not None:
            return _without(curve.name, "cobb-fixed", f"at the {name} stage {reason}", ends, assumed=assumed)
    factors = common_factors(stages)
    levels = [[stage.index(level) for level in ends] for stage in stages]
    factor = np.concatenate([f[i] for f, i in zip(factors, levels, strict=True)])

    def of_rotations(c: Float, R: Float) -> Float:
        return cobb_shares(*(R[..., role, :, 2] for role in range(4)))

    R = np.concatenate([stage.poses.rotation[i] for stage, i in zip(stages, levels, strict=True)])
    errors = errors_of(gradient(of_rotations, np.zeros((4, 3)), R), factor)
    values = [of_rotations(R[:, :, 0], R)]
    if any(bracketed_levels(stage) & set(ends) for stage in stages):
        values += [
            of_rotations(R[:, :, 0], np.concatenate([b.rotation[levels[0]], a.rotation[levels[1]]]))
            for b, a in _alternatives(before, after)
        ]
    total, rotation, distraction, tilt = _shares(np.array(values), np.linalg.norm(errors, axis=1))
    status, open_ends = _determined(ends, [bracketed_levels(stage) for stage in stages])
    of_total = (ends, status, assumed)
    plane = MeasureRequest("plane-of-maximum-curvature", curve.name, ends)
    for name, stage, f in zip(("earlier", "later"), stages, factors, strict=True):
        found = evaluate(plane, stage, f, bracketed_levels(stage))
        reason = plane_reason(plane, found, parameters) or _linear_reason(found, parameters)
        if reason is not None:
            reasons = (open_ends, f"at the {name} stage {reason}")
            both = "; ".join(one for one in reasons if one is not None)
            return Attribution(curve.name, "cobb-fixed", total, _UNKNOWN, _UNKNOWN, _UNKNOWN, both, *of_total)
    return Attribution(curve.name, "cobb-fixed", total, rotation, distraction, tilt, open_ends, *of_total)


def _linear_reason(plane: Evaluation, parameters: MeasureParameters) -> str | None:
    """Return why the errors of a plane are too large for shares of first order, or None."""
    if plane.sd <= parameters.max_azimuth_sd_deg:
        return None
    return (
        f"the plane of maximum curvature is known to {min(plane.sd, 180.0):.0f} degrees only;"
        f" {parameters.max_azimuth_sd_deg:g} are needed"
    )


def _apex(curve: Curve, by_name: dict[str, Attribution], reference: str, *, assumed: bool) -> Attribution:
    """Return the attribution of the change of a curve's apical translation: that of the apex."""
    quantity = "apical-translation"
    if curve.apex is None:
        return _without(curve.name, quantity, no_apex(curve), (curve.upper, curve.lower), assumed=assumed)
    if curve.apex == reference:
        reason = f"the apex {reference} is the reference vertebra"
        return _without(curve.name, quantity, reason, (reference,), assumed=assumed)
    return replace(by_name[curve.apex], subject=curve.name, quantity=quantity)


def _vertebrae(
    before: SpineConfiguration, after: SpineConfiguration, reference: str
) -> tuple[Attribution, ...]:
    """Return the attribution of the change of each vertebra's lateral displacement."""
    names = [level for level in before.levels if level != reference]
    quantity = "lateral-displacement"
    assumed = _assumed((before, after))
    reasons: dict[str, str] = {}
    for name in before.levels:
        for when, stage in (("earlier", before), ("later", after)):
            reason = missing_reason(stage, (name,), rotations=False)
            if reason is not None:
                reasons.setdefault(name, f"at the {when} stage {reason}")
    if reference not in before.levels:
        reasons = dict.fromkeys(
            names, f"the configuration of the spine has no reference vertebra {reference}"
        )
    elif reference in reasons:
        reasons = dict.fromkeys(names, f"of the reference vertebra: {reasons[reference]}")
    known = np.array([name not in reasons for name in before.levels])
    if reference not in before.levels or not known.any():
        return tuple(_without(name, quantity, reasons[name], (name,), assumed=assumed) for name in names)
    marked = np.array(before.marked) & np.array(after.marked)
    parents = _parents(known, known & marked, before.index(reference))
    factors = common_factors((before, after))
    bracketed = [bracketed_levels(stage) for stage in (before, after)]
    found = displacement_shares(before.poses.position_mm, after.poses.position_mm, parents)
    others = [
        displacement_shares(b.position_mm, a.position_mm, parents).shares_mm
        for b, a in _alternatives(before, after)
    ]
    n = len(before.levels)
    known_errors = [np.where(known[:, None, None], factor[:, :3], 0.0) for factor in factors]
    errors = np.zeros((n, 3, factors[0].shape[2]))
    for by_stage, of_stage in zip((found.before_gradient, found.after_gradient), known_errors, strict=True):
        errors += np.tensordot(by_stage, of_stage, axes=2)
    sds = np.linalg.norm(errors, axis=2)
    excess = distraction_excess(before.poses.position_mm, after.poses.position_mm, parents, *known_errors)
    sds[:, 2] = np.sqrt(np.maximum(sds[:, 2] ** 2 - excess, excess))
    attributions = []
    for name in names:
        if name in reasons:
            attributions.append(_without(name, quantity, reasons[name], (name,), assumed=assumed))
            continue
        i = before.index(name)
        status, reason = _determined((name,), bracketed)
        values = [found.shares_mm[i], *(other[i] for other in others if reason is not None)]
        total, rotation, distraction = _shares(np.array(values), sds[i])
        parts = (total, rotation, distraction, _NOTHING)
        attributions.append(Attribution(name, quantity, *parts, reason, (name,), status, assumed))
    return tuple(attributions)


def _parents(known: Bool, nodes: Bool, reference: int) -> list[int | None]:
    """Return for each known vertebra the next node of the way to the reference, or the reference."""
    parents: list[int | None] = [None] * len(known)
    for i in np.flatnonzero(known):
        step = 1 if i < reference else -1
        between = [j for j in range(i + step, reference, step) if nodes[j]]
        if i != reference:
            parents[i] = between[0] if between else reference
    return parents


def _alternatives(
    before: SpineConfiguration, after: SpineConfiguration
) -> Sequence[tuple[SpinePoses, SpinePoses]]:
    """Return the other interpolations of both stages; a stage without one has its poses."""
    size = max(len(before.alternatives), len(after.alternatives))
    start, end = (
        [*stage.alternatives, *[stage.poses] * (size - len(stage.alternatives))] for stage in (before, after)
    )
    return list(zip(start, end, strict=True))


def _shares(values: Float, sds: Float) -> tuple[Share, ...]:
    """Return shares from values (1 + alternatives, m) and standard deviations (m,)."""
    shares = []
    for k, sd in enumerate(sds):
        of_share = values[:, k][~np.isnan(values[:, k])]
        shares.append(Share(float(values[0, k]), float(sd), *normal_interval(of_share, float(sd))))
    return tuple(shares)


def _assumed(stages: Sequence[SpineConfiguration]) -> bool:
    """Return whether a change between stages depends on an assumed initial configuration."""
    return any(stage.assumed for stage in stages)


def _determined(
    levels: Sequence[str], bracketed: Sequence[frozenset[str]]
) -> tuple[MeasureStatus, str | None]:
    """Return how far a change of vertebrae is determined, and why no further, from those bracketed at each stage."""
    open_levels = [[level for level in levels if level in names] for names in bracketed]
    reasons = dict.fromkeys(no_marker(found) for found in open_levels if found)
    return MeasureStatus.BRACKETED if reasons else MeasureStatus.MEASURED, "; ".join(reasons) or None


def _without(
    subject: str, quantity: str, reason: str, levels: tuple[str, ...], *, assumed: bool
) -> Attribution:
    """Return an attribution without numbers."""
    unknown = (_UNKNOWN,) * 4
    return Attribution(subject, quantity, *unknown, reason, levels, MeasureStatus.NOT_MEASURED, assumed)
