"""Measurement of the scale of the markers in a stereo pair."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from spinewatch.arrays import Float, Int
from spinewatch.camera import Rig
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.geometry.small_matrices import inverse_2x2
from spinewatch.geometry.triangulation import Triangulation, triangulate
from spinewatch.matching.marker_scale import MarkerScale, MarkerScaleParameters


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
    rays: tuple[Rays, Rays],
    known: MarkerBalls,
    parameters: MarkerScaleParameters,
    covariance_chi2: tuple[float, int] = (0.0, 0),
) -> MarkerScale | None:
    """Return the scale of the markers in a stereo pair.

    Parameters
    ----------
    rig
        The calibrated cameras.
    rays
        Rays of the left and the right camera: the i-th ones are those of the same ball.
    known
        Known distances between them.
    parameters
        Limits and prior knowledge.
    covariance_chi2
        Chi-square of other residuals of the same rays, and its degrees of freedom. Together with the residuals of the
        distances they scale all deviations, so that large errors of the rays are not mistaken for a drift.

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
    >>> images = rig.left.project(balls), rig.right.project(balls)
    >>> pairs = np.concatenate([model.pairs + 3 * t for t in range(3)])
    >>> known = MarkerBalls(np.repeat(np.arange(3), 3), pairs, np.tile(model.distances_mm, 3))
    >>> rotated = Rig("rotated", rig.left, rig.right.moved(np.radians([0, 0.5, 0]), np.zeros(3)))
    >>> cameras = rotated.left, rotated.right
    >>> rays = tuple(c.rays(xy, 0.01 * np.eye(2)) for c, xy in zip(cameras, images, strict=True))
    >>> found = measure_scale(rotated, rays, known, MarkerScaleParameters())
    >>> round(found.scale, 3), round(found.yaw_deg, 1), found.drifted
    (1.015, -0.5, True)
    """
    p, d = parameters, len(known.distances_mm)
    if d < p.min_distances:
        return None
    points = triangulate(rays)
    lengths, J = _lengths(points.position_mm, known.pairs)
    C = np.einsum("dnj,enj->de", np.einsum("dni,nij->dnj", J, points.covariance_mm2), J)
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
    per_degree = float(weights @ np.einsum("dni,ni->d", J, _shift_by_yaw(points, rays[1])))
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


def _lengths(position_mm: Float, pairs: Int) -> tuple[Float, Float]:
    """Return the distances (d,) between pairs of points (n, 3), and their derivatives (d, n, 3)."""
    a, b = pairs.T
    apart = position_mm[a] - position_mm[b]
    lengths = np.linalg.norm(apart, axis=1)
    unit = apart / lengths[:, None]
    row = np.arange(len(pairs))
    J = np.zeros((len(pairs), len(position_mm), 3))
    J[row, a], J[row, b] = unit, -unit
    return lengths, J


def _shift_by_yaw(points: Triangulation, right: Rays) -> Float:
    """Return how points (n, 3) move if the right camera is rotated about the vertical of its image, mm per degree."""
    vertical = right.pinhole.M[1] * np.radians(1.0)
    turned = (points.position_mm - right.pinhole.centre_mm) @ cross_matrix(vertical).T
    _, J = right.pinhole.project(points.position_mm)
    N = np.swapaxes(J, -1, -2) @ inverse_2x2(right.covariance_mm2) @ J
    return np.asarray(-(points.covariance_mm2 @ N @ turned[..., None])[..., 0])
