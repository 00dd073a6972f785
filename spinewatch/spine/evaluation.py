"""The value of a measure at a stage with its gradient, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.spine.configuration import Origin, SpineConfiguration
from spinewatch.spine.curves import measured_span
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.measure_functions import FORMULAS, horizontal_difference, wrapped
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.plane_vector import PlaneVector
from spinewatch.spine.results import Curve, MeasureStatus
from spinewatch.spine.uncertainty import angle_gradient, errors_of, gradient

_NO_AXIS = 1e-9
"""Length of the cross product of two parallel unit vectors, with what rounding leaves of it."""


@dataclass(frozen=True)
class MeasureRequest:
    """A measure between given vertebrae.

    Attributes
    ----------
    definition
        Identifier of its definition.
    curve
        Name of the curve that it belongs to, or None.
    levels
        Names of the vertebrae, cranial first.
    reason
        Why it cannot be measured at any stage; None if it can.
    """

    definition: str
    curve: str | None
    levels: tuple[str, ...]
    reason: str | None = None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A measure at a stage.

    Attributes
    ----------
    values
        The value, then those of the other interpolations, shape (1 + alternatives,); NaN when not measured.
    errors
        Error of the value per unit error of each source, shape (r,).
    status
        How far it is determined.
    reason
        Why it is bracketed or not measured; None for a measured one.
    own_sd
        Standard deviation of what no source explains and no other stage shares: of the selection of vertebrae.
    vector
        For the 3-D angle the rotation vector of one z against the other in the plane across both, degrees, whose length
        is the angle; for the plane of maximum curvature the horizontal part of the difference of both z, whose
        direction is the plane; None for others and when not measured.
    """

    values: Float
    errors: Float
    status: MeasureStatus
    reason: str | None
    own_sd: float = 0.0
    vector: PlaneVector | None = None

    @property
    def value(self) -> float:
        """The value."""
        return float(self.values[0])

    @property
    def sd(self) -> float:
        """Its standard deviation."""
        return float(np.hypot(np.linalg.norm(self.errors), self.own_sd))


def curve_requests(curve: Curve) -> tuple[MeasureRequest, ...]:
    """Return the measures of a curve whose vertebrae do not change.

    Parameters
    ----------
    curve
        The curve.

    Returns
    -------
    tuple of MeasureRequest
        The measures in the order of the report.
    """
    ends: tuple[str, ...] = (curve.upper, curve.lower)
    apex, all_three, reason = ends, ends, None
    if curve.apex is None:
        reason = no_apex(curve)
    else:
        apex, all_three = (curve.apex,), (curve.upper, curve.apex, curve.lower)
    return (
        MeasureRequest("cobb-fixed", curve.name, ends),
        MeasureRequest("apical-rotation", curve.name, apex, reason),
        MeasureRequest("apical-rotation-projected", curve.name, apex, reason),
        MeasureRequest("apical-translation", curve.name, apex, reason),
        MeasureRequest("ferguson", curve.name, all_three, reason),
        MeasureRequest("angle-3d", curve.name, ends),
        MeasureRequest("plane-of-maximum-curvature", curve.name, ends),
    )


def no_apex(curve: Curve) -> str:
    """Return the reason why a curve has no apex.

    Parameters
    ----------
    curve
        The curve, whose end vertebrae are neighbours.

    Returns
    -------
    str
        A clause.
    """
    return f"no vertebra lies between {curve.upper} and {curve.lower}, so that none is the apex"


def spine_requests(baseline: SpineConfiguration, parameters: MeasureParameters) -> tuple[MeasureRequest, ...]:
    """Return the measures of the whole spine.

    Parameters
    ----------
    baseline
        The spine at the baseline stage.
    parameters
        Pairs of vertebrae for kyphosis and lordosis.

    Returns
    -------
    tuple of MeasureRequest
        Kyphosis, lordosis and coronal balance.
    """
    requests = [
        MeasureRequest(definition, None, pair)
        for definition, pairs in (("kyphosis", parameters.kyphosis), ("lordosis", parameters.lordosis))
        for number, pair in enumerate(pairs)
        if number == 0 or set(pair) <= set(baseline.levels)
    ]
    span = measured_span(baseline)
    if len(span) >= 2:
        ends = (baseline.levels[span[0]], baseline.levels[span[-1]])
        requests.append(MeasureRequest("coronal-balance", None, ends))
    return tuple(requests)


def bracketed_levels(configuration: SpineConfiguration) -> frozenset[str]:
    """Return the vertebrae whose pose is interpolated, is assumed without a marker, or differs by interpolation.

    Parameters
    ----------
    configuration
        The spine at a stage.

    Returns
    -------
    frozenset of str
        Their names.
    """
    differs = np.zeros(len(configuration.levels), dtype=bool)
    for poses in configuration.alternatives:
        differs |= (poses.rotation != configuration.poses.rotation).any(axis=(1, 2)) & ~np.isnan(
            poses.rotation
        ).any(axis=(1, 2))
    return frozenset(
        name
        for name, origin, marked, different in zip(
            configuration.levels, configuration.origins, configuration.marked, differs, strict=True
        )
        if origin is Origin.INTERPOLATED or (not marked and (different or origin is Origin.ASSUMED))
    )


def evaluate(
    request: MeasureRequest, configuration: SpineConfiguration, factor: Float, bracketed: frozenset[str]
) -> Evaluation:
    """Return a measure at a stage.

    Parameters
    ----------
    request
        The measure.
    configuration
        The spine at the stage.
    factor
        Its error factors side by side, shape (n, 6, r), as of `uncertainty.common_factors`.
    bracketed
        Vertebrae that are only bracketed, as of `bracketed_levels`.

    Returns
    -------
    Evaluation
        The measure, or why it is not measured.
    """
    formula = FORMULAS[request.definition]
    names = request.levels
    reason = request.reason
    if formula.from_line and configuration.reference in configuration.levels:
        if names == (configuration.reference,):
            reason = f"{configuration.reference} is the reference vertebra, which it is measured from"
        names = (*names, configuration.reference or "")
    reason = reason or missing_reason(
        configuration, names, positions=formula.positions, rotations=formula.rotations
    )
    if reason is not None:
        none = np.full(1, np.nan)
        return Evaluation(none, np.full(factor.shape[2], np.nan), MeasureStatus.NOT_MEASURED, reason)
    levels = np.array([configuration.index(name) for name in names])
    c, R = configuration.poses.position_mm[levels], configuration.poses.rotation[levels]
    angular = DEFINITIONS[request.definition].unit == "deg"
    open_levels = [name for name in names if name in bracketed]
    values, turned = np.atleast_1d(formula.function(c, R)), R[None]
    status, reason = MeasureStatus.MEASURED, None
    if open_levels:
        status, reason = MeasureStatus.BRACKETED, no_marker(open_levels)
        others = np.array(
            [formula.function(p.position_mm[levels], p.rotation[levels]) for p in configuration.alternatives]
        )
        known = ~np.isnan(others)
        turned = np.stack(
            [R, *(p.rotation[levels] for p, k in zip(configuration.alternatives, known, strict=True) if k)]
        )
        others = others[known]
        values = np.concatenate(
            [values, values[0] + (wrapped(others - values[0]) if angular else others - values[0])]
        )
    if request.definition == "angle-3d":
        errors, vector = _angle_3d_errors(turned, values, factor, levels)
        return Evaluation(values, errors, status, reason, vector=vector)
    by_pose = (angle_gradient if angular else gradient)(formula.function, c, R)
    errors = errors_of(by_pose, factor[levels])
    if request.definition == "plane-of-maximum-curvature":
        return Evaluation(values, errors, status, reason, vector=_difference(c, turned, factor[levels]))
    return Evaluation(values, errors, status, reason)


def held_reason(request: MeasureRequest, configuration: SpineConfiguration) -> str | None:
    """Return why a measure of the reference vertebra alone says nothing of its motion; None for every other measure.

    Parameters
    ----------
    request
        The measure.
    configuration
        The spine at a stage.

    Returns
    -------
    str or None
        A clause.
    """
    if request.levels != (configuration.reference,):
        return None
    return (
        f"{configuration.reference} is the reference vertebra, which is held as it was at the baseline stage"
    )


def no_marker(levels: list[str]) -> str:
    """Return the reason why a measure is bracketed.

    Parameters
    ----------
    levels
        The interpolated vertebrae that it is measured at.

    Returns
    -------
    str
        A clause.
    """
    return f"{' and '.join(levels)} {'has' if len(levels) == 1 else 'have'} no marker at this stage"


def missing_reason(
    configuration: SpineConfiguration,
    levels: tuple[str, ...],
    *,
    positions: bool = True,
    rotations: bool = True,
) -> str | None:
    """Return why vertebrae have no pose, or None if all have.

    Parameters
    ----------
    configuration
        The spine at a stage.
    levels
        The vertebrae.
    positions, rotations
        Whether their centroids and their rotations are needed.

    Returns
    -------
    str or None
        A clause about the first vertebra that lacks something.
    """
    for name in levels:
        if name not in configuration.levels:
            return f"the configuration of the spine has no {name}"
        i = configuration.index(name)
        poses = configuration.poses
        if (positions and np.isnan(poses.position_mm[i]).any()) or (
            rotations and np.isnan(poses.rotation[i]).any()
        ):
            return f"{name} was not measured: {configuration.reasons[i] or 'it has no pose'}"
    return None


def _angle_3d_errors(R: Float, values: Float, factor: Float, levels: Int) -> tuple[Float, PlaneVector]:
    """Return the errors of the 3-D angle by source, and the vector whose length it is.

    The angle changes by the relative rotation of the two z about the axis on which one is turned into the other; where
    there is no such axis, about that of the largest error. ``R`` are the rotations by each interpolation, ``values``
    the angles.
    """
    upper, lower = R[:, 0, :, 2], R[:, 1, :, 2]
    relative = factor[levels[0], 3:] - factor[levels[1], 3:]
    middle = (upper[0] + lower[0]) / max(float(np.linalg.norm(upper[0] + lower[0])), 1e-12)
    axes = np.cross(lower, upper)
    axis = axes[0]
    if np.linalg.norm(axis) < _NO_AXIS:
        level = np.eye(3) - np.outer(middle, middle)
        axis = np.linalg.eigh(level @ relative @ relative.T @ level)[1][:, -1]
        axis = level @ axis
        if np.linalg.norm(axis) < _NO_AXIS:
            axis = np.zeros(3)
    axis = axis / max(float(np.linalg.norm(axis)), _NO_AXIS)
    plane = np.stack([axis, np.cross(middle, axis)])
    vectors = axes @ plane.T
    vectors[0] = [1.0, 0.0]
    vectors *= (values / np.maximum(np.linalg.norm(vectors, axis=1), _NO_AXIS))[:, None]
    errors = plane @ relative
    return errors[0], PlaneVector(vectors, errors @ errors.T)


def _difference(c: Float, R: Float, factor: Float) -> PlaneVector:
    """Return the horizontal part of the difference of both z by each interpolation, whose rotations are ``R``."""
    by_pose = gradient(lambda _, S: horizontal_difference(S[..., 0, :, :], S[..., 1, :, :]), c, R[0])
    errors = errors_of(by_pose, factor)
    return PlaneVector(horizontal_difference(R[:, 0], R[:, 1]), errors @ errors.T)
