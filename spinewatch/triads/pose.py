"""Position and full orientation of a triad from its three balls; NumPy only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.camera import Float
from spinewatch.errors import SpinewatchError


class DegenerateTriadError(SpinewatchError):
    """Three balls coincide or lie on one line, so that no orientation follows from them."""

    code = "degenerate-triad"


@dataclass(frozen=True, eq=False)
class Ball:
    """One ball of a marker.

    ``position_mm`` (3,) and ``covariance_mm2`` (3, 3) in object space: of its two rays, or of the marker's
    pose when a view does not show it. Its images ``left_px`` and ``right_px`` (2,), None where hidden, and
    the distance ``parallax_mm`` by which its two rays miss each other.
    """

    position_mm: Float
    covariance_mm2: Float
    left_px: Float | None
    right_px: Float | None
    parallax_mm: float | None

    @property
    def hidden_in(self) -> tuple[str, ...]:
        """The views that do not show it."""
        sides = (("left", self.left_px), ("right", self.right_px))
        return tuple(side for side, image in sides if image is None)


@dataclass(frozen=True, eq=False)
class Pose:
    """A triad in object space.

    ``position_mm`` (3,) of P; ``rotation`` (3, 3), whose columns are the triad's axes (x = MX to XX, z =
    normal); ``covariance`` (6, 6) of the position in mm and of a small rotation vector about the OBJECT axes
    in degrees, with ``R_true = Exp(dtheta) R``.
    """

    position_mm: Float
    rotation: Float
    covariance: Float

    @property
    def normal(self) -> Float:
        """Unit normal (3,), the thesis's orientation of a triad (fig. 5.7)."""
        return self.rotation[:, 2]

    @property
    def angles_deg(self) -> Float:
        """Angles (alpha, beta, gamma) of the normal with the object axes X, Y, Z, degrees."""
        return np.degrees(np.arccos(np.clip(self.normal, -1, 1)))

    @property
    def position_sd_mm(self) -> Float:
        """Standard deviations (3,) of the position along the object axes, mm."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def rotation_sd_deg(self) -> Float:
        """Standard deviations (3,) of the rotation about the triad's own x, y and z axes, degrees."""
        return np.sqrt(np.diag(self.rotation.T @ self.covariance[3:, 3:] @ self.rotation))


@dataclass(frozen=True, eq=False)
class MeasuredTriad:
    """A triad found in a stereo pair: the name of its model, its balls by name, and its pose.

    ``error_mm`` is the distance-matrix error of eq. 5.17, of the balls that both views show; it finds gross
    faults and says nothing of accuracy. ``pose`` is None when the balls seen do not determine it; then
    ``reason`` says so, and ``balls`` are those that both views show.
    """

    model: str
    balls: Mapping[str, Ball]
    pose: Pose | None
    error_mm: float
    reason: str | None = None

    @property
    def place_mm(self) -> Float:
        """P (3,), or the middle of the balls that were seen when there is no pose."""
        if self.pose is not None:
            return self.pose.position_mm
        return np.asarray(np.mean([ball.position_mm for ball in self.balls.values()], axis=0))


def rough_pose(model_mm: Float, balls_mm: Float) -> tuple[Float, Float]:
    """Return origins (..., 3) and rotations (..., 3, 3) of markers with balls (..., n, 3), not of best fit.

    The cheap form, for weighing candidates and starting a fit: axes come from three balls, the origin from
    the middle of all. For a flat triad z is the thesis's orientation, (b0 - b2) x (b0 - b1) of unit length
    (fig. 5.7); ``absolute_orientation`` weighs all balls alike.
    """
    R = _three_ball_axes(balls_mm) @ _three_ball_axes(model_mm).T
    origin = balls_mm.mean(axis=-2) - R @ model_mm.mean(axis=0)
    return np.asarray(origin), np.asarray(R)


def _three_ball_axes(balls_mm: Float) -> Float:
    x, across = (balls_mm[..., 0, :] - balls_mm[..., k, :] for k in (2, 1))
    z = np.cross(x, across)
    x, z = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (x, z))
    return np.stack([x, np.cross(z, x), z], axis=-1)


def absolute_orientation(model_mm: Float, points_mm: Float) -> tuple[Float, Float]:
    """Return rotations (..., 3, 3) and origins (..., 3) that best carry model points onto measured points.

    ``model_mm`` (n, 3) in the triad's frame, ``points_mm`` (..., n, 3) in object space. Kabsch and Umeyama
    with scale 1; the determinant is forced to +1, since three points have rank 2 and would admit the mirror
    image. Raises ``DegenerateTriadError`` when points of a set lie on one line. Replaces the thesis's normal
    alone, which does not know the turn about itself.
    """
    centre = points_mm.mean(axis=-2, keepdims=True)
    model_centre = model_mm.mean(axis=0)
    U, s, Vt = np.linalg.svd(np.swapaxes(points_mm - centre, -1, -2) @ (model_mm - model_centre))
    if np.any(s[..., 1] < 1e-9 * np.maximum(s[..., 0], 1e-300)):
        raise DegenerateTriadError(
            "the balls of a triad lie on one line; check the features it was made from"
        )
    sign = np.ones_like(s)
    sign[..., 2] = np.linalg.det(U) * np.linalg.det(Vt)
    R = (U * sign[..., None, :]) @ Vt
    return R, centre[..., 0, :] - R @ model_centre


def kabsch_pose(model_mm: Float, balls_mm: Float, covariances_mm2: Float) -> Pose:
    """Return the absolute orientation of one triad's balls (3, 3) as a pose with its covariance."""
    R, origin = absolute_orientation(model_mm, balls_mm)
    return Pose(origin, R, orientation_covariance(origin, balls_mm, covariances_mm2))


def orientation_covariance(origin_mm: Float, points_mm: Float, covariances_mm2: Float) -> Float:
    """Return the (6, 6) covariance (mm, degrees, object axes) of an unweighted ``absolute_orientation``.

    ``origin_mm`` (3,), ``points_mm`` (n, 3), their ``covariances_mm2`` (n, 3, 3), independent of each other.
    First order: with r from the centroid and K = sum(|r|^2 I - r r^T), the rotation vector is
    ``K^-1 sum [r]x e``, the origin ``mean(e) - [origin - centroid]x theta``.
    """
    n = len(points_mm)
    centre = points_mm.mean(axis=0)
    r = points_mm - centre
    K = (r * r).sum() * np.eye(3) - r.T @ r
    to_rotation = np.linalg.solve(K, cross_matrix(r))  # (n, 3, 3)
    to_origin = np.eye(3) / n - cross_matrix(origin_mm - centre) @ to_rotation
    J = np.concatenate([to_origin, np.degrees(to_rotation)], axis=1)
    return np.asarray((J @ covariances_mm2 @ np.swapaxes(J, -1, -2)).sum(axis=0))


def cross_matrix(v: Float) -> Float:
    """Return the matrices (..., 3, 3) with ``cross_matrix(v) @ w == cross(v, w)`` of vectors (..., 3)."""
    x, y, z = np.moveaxis(v, -1, 0)
    o = np.zeros_like(x)
    return np.stack([np.stack([o, -z, y], -1), np.stack([z, o, -x], -1), np.stack([-y, x, o], -1)], -2)


def rotation_from_vector(vector_rad: Float) -> Float:
    """Return rotations (..., 3, 3) = Exp of rotation vectors (..., 3) in radians (Rodrigues)."""
    angle = np.linalg.norm(vector_rad, axis=-1)[..., None, None]
    W = cross_matrix(vector_rad)
    R = np.eye(3) + np.sinc(angle / np.pi) * W + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (W @ W)
    return np.asarray(R)


def vectors_from_rotations(R: Float) -> Float:
    """Return the rotation vectors (n, 3) in radians of rotations (n, 3, 3)."""
    return np.array([vector_from_rotation(matrix) for matrix in R]).reshape(-1, 3)


def vector_from_rotation(R: Float) -> Float:
    """Return the rotation vector (3,) in radians, of length at most pi, of a rotation (3, 3).

    Through the quaternion of largest component (Shepperd), which keeps its digits near 0 and near 180
    degrees.
    """
    t = np.trace(R)
    q2 = np.array([t, R[0, 0], R[1, 1], R[2, 2]])
    i = int(np.argmax(q2))
    if i == 0:
        q = np.array([1 + t, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        j, k = i % 3 + 1, (i + 1) % 3 + 1
        q = np.empty(4)
        q[0] = R[k - 1, j - 1] - R[j - 1, k - 1]
        q[i] = 1 + 2 * R[i - 1, i - 1] - t
        q[j] = R[j - 1, i - 1] + R[i - 1, j - 1]
        q[k] = R[k - 1, i - 1] + R[i - 1, k - 1]
    q = q / np.linalg.norm(q) * (-1 if q[0] < 0 else 1)
    sine = np.linalg.norm(q[1:])
    if sine == 0:
        return np.zeros(3)
    return np.asarray(q[1:] / sine * 2 * np.arctan2(sine, q[0]))
