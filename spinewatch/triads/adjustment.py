"""The maximum-likelihood pose of a triad: six parameters fitted to the ball images of both views at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spinewatch.camera import Float
from spinewatch.correspondence.intersection import plate_projection
from spinewatch.correspondence.rays import Rays
from spinewatch.triads.model import TriadModel
from spinewatch.triads.pose import Pose, cross_matrix, rotation_from_vector

_STEPS = 30
_TOLERANCE = 1e-9  # mm and radians


def adjust_poses(
    model: TriadModel, views: Sequence[Rays], position_mm: Float, rotation: Float
) -> tuple[tuple[Pose, ...], Float]:
    """Return the poses of t triads with least weighted image residuals, and their chi2 (t,).

    ``views`` hold each camera's 3 t rays to the balls, in the model's order; ``position_mm`` (t, 3) and
    ``rotation`` (t, 3, 3) start the fit, from the absolute orientation of the intersected balls. The marker's
    known distances bind the ranges of its balls, so that rotations come out a quarter to a third better than
    that. Chi2 has 6 degrees of freedom with two views. Gauss-Newton on the collinearity equations 3.4, with
    residuals on the undistorted plate.
    """
    t = len(position_mm)
    P, R = position_mm, rotation
    weights = [_inverse(rays.covariance_mm2) for rays in views]
    for _ in range(_STEPS):
        N, b, _ = _normal_equations(model, views, weights, P, R)
        step = np.asarray(np.linalg.solve(N, b[..., None])[..., 0], dtype=np.float64)
        P, R = P + step[:, :3], rotation_from_vector(step[:, 3:]) @ R
        if not np.any(np.abs(step) > _TOLERANCE):
            break
    N, _, chi2 = _normal_equations(model, views, weights, P, R)
    unit = np.repeat([1.0, np.degrees(1.0)], 3)
    S = _inverse(N) * np.outer(unit, unit)
    return tuple(Pose(P[i], R[i], S[i]) for i in range(t)), chi2


def _inverse(matrices: Float) -> Float:
    return np.asarray(np.linalg.inv(matrices), dtype=np.float64)


def _normal_equations(
    model: TriadModel, views: Sequence[Rays], weights: Sequence[Float], P: Float, R: Float
) -> tuple[Float, Float, Float]:
    """Return N (t, 6, 6), b (t, 6) and chi2 (t,) of the linearised residuals, turning about object axes."""
    t = len(P)
    arms = model.coordinates_mm @ np.swapaxes(R, -1, -2)
    to_balls = np.concatenate([np.broadcast_to(np.eye(3), (t, 3, 3, 3)), -cross_matrix(arms)], axis=-1)
    N, b, chi2 = np.zeros((t, 6, 6)), np.zeros((t, 6)), np.zeros(t)
    for rays, weight in zip(views, weights, strict=True):
        predicted, to_plate = plate_projection(rays.camera, P[:, None, :] + arms)
        miss = (rays.ideal_mm.reshape(t, 3, 2) - predicted)[..., None]
        J = to_plate @ to_balls
        Jt_W = np.swapaxes(J, -1, -2) @ weight.reshape(t, 3, 2, 2)
        N += (Jt_W @ J).sum(axis=1)
        b += (Jt_W @ miss).sum(axis=1)[..., 0]
        chi2 += (np.swapaxes(miss, -1, -2) @ weight.reshape(t, 3, 2, 2) @ miss).sum(axis=(1, 2, 3))
    return N, b, chi2
