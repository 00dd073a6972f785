"""Measurement of the scale of the markers in a stereo pair."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from spinewatch.arrays import Float, Int
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.triangulation import Triangulation, triangulate
from spinewatch.matching.marker_scale import MarkerScale, MarkerScaleParameters

_STEP_DEG = 0.1
"""Rotation about the vertical for the numerical derivative of the scale, degrees."""


@dataclass(frozen=True, eq=False)
class MarkerBalls:
    """What the markers define about n balls.

    Attributes
    ----------
    marker
        Number of each ball's marker, shape (n,).
    pairs
        Indices of two balls each, shape (d, 2).
    distances_mm
        Their known distances, shape (d,), mm.
    """

    marker: Int
    pairs: Int
    distances_mm: Float


def measure_scale(
    rig: Rig,
    left: Features,
    right: Features,
    known: MarkerBalls,
    parameters: MarkerScaleParameters,
    covariance_chi2: tuple[float, int] = (0.0, 0),
) -> MarkerScale | None:
    """Return the scale of the markers in a stereo pair.

    Parameters
    ----------
    rig
        The calibrated cameras.
    left, right
        Images of the balls: the i-th features belong to the same ball.
    known
        Known distances between them.
    parameters
        Limits and prior knowledge.
    covariance_chi2
        Chi-square of other residuals of the same features, and its degrees of freedom. Together with the residuals of
        the distances they scale all deviations, so that large errors of the features are not mistaken for a drift.

    Returns
    -------
    MarkerScale or None
        The scale by generalized least squares; None for too few distances.

    References
    ----------
    Not in the thesis, which uses the distances to identify the balls (section 5.6).

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.markers import FLAT_10_14_18 as model
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig, centres = large_rig(), np.array([[400.0, 390, 90], [450, 395, 85], [500, 390, 80]])
    >>> balls = (centres[:, None] + model.coordinates_mm).reshape(-1, 3)
    >>> left, right = (Features.with_sigma(c.project(balls), np.ones(9), 0.1) for c in (rig.left, rig.right))
    >>> pairs = np.concatenate([model.pairs + 3 * t for t in range(3)])
    >>> known = MarkerBalls(np.repeat(np.arange(3), 3), pairs, np.tile(model.distances_mm, 3))
    >>> rotated = Rig("rotated", rig.left, rig.right.moved(np.radians([0, 0.5, 0]), np.zeros(3)))
    >>> found = measure_scale(rotated, left, right, known, MarkerScaleParameters())
    >>> round(found.scale, 3), round(found.yaw_deg, 1), found.drifted
    (1.015, -0.5, True)
    """
    p, d = parameters, len(known.distances_mm)
    if d < p.min_distances:
        return None
    points = _triangulated(rig, left, right)
    lengths, C = _lengths(points, known.pairs)
    errors, size = lengths - known.distances_mm, known.distances_mm
    S = C + p.marker_sd_mm**2 * np.eye(d)
    weights = np.linalg.solve(S, size)
    weights /= weights @ size
    change = float(weights @ errors)
    residual = errors - change * size
    other, other_dof = covariance_chi2
    dof = other_dof + d - 1
    variance_factor = float(other + residual @ np.linalg.solve(S, residual)) / dof
    sd = float(np.sqrt(variance_factor * (weights @ C @ weights)))
    made = p.marker_sd_mm * float(np.sqrt(variance_factor * (weights @ weights)))
    common_sd = float(np.hypot(made, p.calibration_sd))
    p_value = float(2 * stdtr(dof, -abs(change) / np.hypot(sd, common_sd)))
    moved = Rig(rig.name, rig.left, rig.right.moved(np.radians([0.0, _STEP_DEG, 0.0]), np.zeros(3)))
    moved_lengths, _ = _lengths(_triangulated(moved, left, right), known.pairs)
    per_degree = float(weights @ (moved_lengths - lengths)) / _STEP_DEG
    scale = 1 + change
    return MarkerScale(
        distances=d,
        scale=scale,
        sd=sd,
        common_sd=common_sd,
        p_value=p_value,
        drifted=p_value < p.max_p_value,
        yaw_deg=-change / per_degree,
        base_mm=(1 / scale - 1) * rig.baseline_mm,
    )


def _triangulated(rig: Rig, left: Features, right: Features) -> Triangulation:
    """Return the points of n balls."""
    return triangulate([left.rays(rig.left), right.rays(rig.right)])


def _lengths(points: Triangulation, pairs: Int) -> tuple[Float, Float]:
    """Return the distances (d,) between pairs of points and their covariance (d, d)."""
    a, b = pairs.T
    apart = points.position_mm[a] - points.position_mm[b]
    lengths = np.linalg.norm(apart, axis=1)
    unit = apart / lengths[:, None]
    row = np.arange(len(pairs))
    J = np.zeros((len(pairs), len(points.position_mm), 3))
    J[row, a], J[row, b] = unit, -unit
    JS = np.einsum("dni,nij->dnj", J, points.covariance_mm2)
    return lengths, np.einsum("dnj,enj->de", JS, J)
