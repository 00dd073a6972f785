"""The maximum-likelihood pose of a triad: six parameters fitted to the ball images of both views at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.geometry.projection import Pinhole
from spinewatch.geometry.rotations import cross_matrix, rotation_from_vector
from spinewatch.triads.pose import Pose

_STEPS = 30
_TOLERANCE = 1e-9  # mm and radians
_HOLD = 1e12  # 1/rad^2
_LONGEST_TURN = 0.5  # rad in one step
_LEAST_CONDITION = 1e-9  # of the normal equations in mm and radians times a marker's size


@dataclass(frozen=True, eq=False)
class TriadImages:
    """The images of t triads of n balls in one camera.

    ``ideal_mm`` (t, n, 2) undistorted plate offsets; ``weight`` (t, n, 2, 2), their inverse covariance, zero
    for a hidden ball. ``common_sd_mm``, on the plate: an error that all balls of a triad share in this view.
    """

    pinhole: Pinhole
    ideal_mm: Float
    weight: Float
    common_sd_mm: float = 0.0

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Whether each ball is seen (t, n)."""
        return np.asarray(self.weight[..., 0, 0] > 0)


@dataclass(frozen=True, eq=False)
class PoseAdjustment:
    """t fitted poses: positions (t, 3) mm, rotations (t, 3, 3), covariances (t, 6, 6) as in ``Pose``.

    ``chi2`` (t,) of the image residuals with ``freedom`` (t,) degrees of freedom; ``determined`` (t,) is false
    where the images leave some motion free, and there the covariance is NaN.
    """

    position_mm: Float
    rotation: Float
    covariance: Float
    chi2: Float
    freedom: NDArray[np.intp]
    determined: NDArray[np.bool_]

    def pose(self, index: int) -> Pose:
        """Return one of them."""
        return Pose(self.position_mm[index], self.rotation[index], self.covariance[index])


def adjust_poses(
    model_mm: Float,
    views: Sequence[TriadImages],
    position_mm: Float,
    rotation: Float,
    steps: int = _STEPS,
    held_axis: Float | None = None,
) -> PoseAdjustment:
    """Return the poses of t markers with least weighted image residuals.

    ``model_mm`` (n, 3); ``position_mm`` (t, 3) and ``rotation`` (t, 3, 3) start the fit, from the absolute
    orientation of the intersected balls. The marker's known distances bind the ranges of its balls, so that
    rotations come out a quarter to a third better than that. Gauss-Newton on the collinearity equations 3.4,
    with residuals on the undistorted plate. The error that the balls of a view share is a further unknown of
    each view, eliminated from the normal equations: it widens positions and leaves rotations nearly alone.
    ``held_axis`` (t, 3), unit vectors in object space, are axes about which the poses may not turn.
    """
    P, R = position_mm, rotation
    held = np.zeros((len(P), 6, 6))
    if held_axis is not None:
        held[:, 3:, 3:] = _HOLD * held_axis[:, :, None] * held_axis[:, None, :]
    for _ in range(steps):
        N, b, _ = _normal_equations(model_mm, views, P, R)
        N += held
        step = np.asarray(np.linalg.solve(_regular(N), b[..., None])[..., 0], dtype=np.float64)
        turn = np.linalg.norm(step[:, 3:], axis=1, keepdims=True)
        step = step / np.maximum(turn / _LONGEST_TURN, 1.0)
        P, R = P + step[:, :3], rotation_from_vector(step[:, 3:]) @ R
        if not np.any(np.abs(step) > _TOLERANCE):
            break
    N, _, chi2 = _normal_equations(model_mm, views, P, R)
    covariance, determined = _covariance(N + held, float(np.linalg.norm(model_mm, axis=1).max()))
    freedom = 2 * sum((view.seen.sum(axis=1) for view in views), np.zeros(len(P), dtype=np.intp)) - 6
    return PoseAdjustment(P, R, covariance, chi2, np.asarray(freedom, dtype=np.intp), determined)


def _covariance(N: Float, size_mm: float) -> tuple[Float, NDArray[np.bool_]]:
    even = np.repeat([1.0, 1 / size_mm], 3)  # a turn moves balls by its angle times the marker's size
    values = np.linalg.eigvalsh(N * np.outer(even, even))
    determined = values[:, 0] > _LEAST_CONDITION * values[:, -1]
    unit = np.repeat([1.0, np.degrees(1.0)], 3)
    S = np.full(N.shape, np.nan)
    S[determined] = np.linalg.inv(N[determined]) * np.outer(unit, unit)
    return S, np.asarray(determined)


def _regular(N: Float) -> Float:
    """Return N with a trace of damping, so that undetermined motions stay where they are."""
    damping = 1e-12 * np.trace(N, axis1=1, axis2=2)[:, None, None]
    return np.asarray(N + damping * np.eye(6))


def _normal_equations(
    model_mm: Float, views: Sequence[TriadImages], P: Float, R: Float
) -> tuple[Float, Float, Float]:
    """Return N (t, 6, 6), b (t, 6) and chi2 (t,) of the linearised residuals, turning about object axes."""
    t, n = len(P), len(model_mm)
    arms = model_mm @ np.swapaxes(R, -1, -2)
    to_balls = np.concatenate([np.broadcast_to(np.eye(3), (t, n, 3, 3)), -cross_matrix(arms)], axis=-1)
    N, b, chi2 = np.zeros((t, 6, 6)), np.zeros((t, 6)), np.zeros(t)
    for view in views:
        predicted, to_plate = view.pinhole.project(P[:, None, :] + arms)
        miss = (view.ideal_mm - predicted)[..., None]
        J = to_plate @ to_balls
        W_J, W_miss = view.weight @ J, view.weight @ miss
        N += (np.swapaxes(J, -1, -2) @ W_J).sum(axis=1)
        b += (np.swapaxes(J, -1, -2) @ W_miss).sum(axis=1)[..., 0]
        chi2 += (miss * W_miss).sum(axis=(1, 2, 3))
        if view.common_sd_mm > 0:
            shared = np.linalg.inv(view.weight.sum(axis=1) + np.eye(2) / view.common_sd_mm**2)
            J_shared, miss_shared = W_J.sum(axis=1), W_miss.sum(axis=1)
            gain = np.swapaxes(J_shared, -1, -2) @ shared
            N -= gain @ J_shared
            b -= (gain @ miss_shared)[..., 0]
            chi2 -= (miss_shared * (shared @ miss_shared)).sum(axis=(1, 2))
    return N, b, chi2
