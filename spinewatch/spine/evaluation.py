"""The value of a measure at a stage with its gradient, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.spine.configuration import Origin, SpineConfiguration
from spinewatch.spine.curves import measured_span
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.measure_functions import FORMULAS, wrapped
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.results import Curve, MeasureStatus
from spinewatch.spine.uncertainty import angle_gradient, errors_of, gradient


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
    """

    definition: str
    curve: str | None
    levels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A measure at a stage.

    Attributes
    ----------
    values
        The value, then those of the other interpolations, shape (1 + alternatives,); NaN when not measured.
    errors
        Error of the value per unit error of each source, shape (r,).
    sd_across
        For the 3-D angle the deviation of one z against the other across the plane of both, degrees; 0 for others.
    status
        How far it is determined.
    reason
        Why it is bracketed or not measured; None for a measured one.
    own_sd
        Standard deviation of what no source explains and no other stage shares: of the selection of vertebrae.
    """

    values: Float
    errors: Float
    sd_across: float
    status: MeasureStatus
    reason: str | None
    own_sd: float = 0.0

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
    ends, apex = (curve.upper, curve.lower), (curve.apex,)
    levels = {
        "cobb-fixed": ends,
        "apical-rotation": apex,
        "apical-rotation-projected": apex,
        "apical-translation": apex,
        "ferguson": (curve.upper, curve.apex, curve.lower),
        "angle-3d": ends,
        "plane-of-maximum-curvature": ends,
    }
    return tuple(MeasureRequest(definition, curve.name, names) for definition, names in levels.items())


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
    """Return the vertebrae whose pose another interpolation of the same data changes, or that are interpolated.

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
        if origin is Origin.INTERPOLATED or (different and not marked)
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
    if formula.from_line and configuration.reference in configuration.levels:
        names = (*names, configuration.reference or "")
    reason = missing_reason(configuration, names, positions=formula.positions, rotations=formula.rotations)
    if reason is not None:
        none = np.full(1, np.nan)
        return Evaluation(none, np.full(factor.shape[2], np.nan), 0.0, MeasureStatus.NOT_MEASURED, reason)
    levels = np.array([configuration.index(name) for name in names])
    c, R = configuration.poses.position_mm[levels], configuration.poses.rotation[levels]
    angular = DEFINITIONS[request.definition].unit == "deg"
    sd_across = 0.0
    if request.definition == "angle-3d":
        errors, sd_across = _angle_3d_errors(R, factor, levels)
    else:
        by_pose = (angle_gradient if angular else gradient)(formula.function, c, R)
        errors = errors_of(by_pose, factor[levels])
    open_levels = [name for name in names if name in bracketed]
    values = np.atleast_1d(formula.function(c, R))
    if open_levels:
        others = np.array(
            [formula.function(p.position_mm[levels], p.rotation[levels]) for p in configuration.alternatives]
        )
        others = others[~np.isnan(others)]
        values = np.concatenate(
            [values, values[0] + (wrapped(others - values[0]) if angular else others - values[0])]
        )
        return Evaluation(values, errors, sd_across, MeasureStatus.BRACKETED, no_marker(open_levels))
    return Evaluation(values, errors, sd_across, MeasureStatus.MEASURED, None)


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


def _angle_3d_errors(R: Float, factor: Float, levels: Int) -> tuple[Float, float]:
    """Return the errors of the 3-D angle by source and the deviation across.

    The angle changes by the relative rotation of the two z about the axis on which one is turned into the other; where
    there is no such axis, about that of the largest error.
    """
    upper, lower = R[0, :, 2], R[1, :, 2]
    relative = factor[levels[0], 3:] - factor[levels[1], 3:]
    middle = (upper + lower) / max(float(np.linalg.norm(upper + lower)), 1e-12)
    axis = np.cross(lower, upper)
    if np.linalg.norm(axis) < 1e-9:
        level = np.eye(3) - np.outer(middle, middle)
        axis = np.linalg.eigh(level @ relative @ relative.T @ level)[1][:, -1]
        axis = level @ axis
        if np.linalg.norm(axis) < 1e-9:
            return np.zeros(factor.shape[2]), 0.0
    axis = axis / np.linalg.norm(axis)
    return axis @ relative, float(np.linalg.norm(np.cross(middle, axis) @ relative))
