"""Direct Linear Transformation with radial distortion (eq. 3.1): a camera without a starting guess."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.calibration.errors import (
    ConvergenceError,
    MirroredFieldError,
    PlanarFieldError,
    TooFewPointsError,
)
from spinewatch.calibration.points import ImagePoints, Sensor, flatness
from spinewatch.camera import Camera

MIN_POINTS = 6
MIN_FLATNESS = 0.02
"""Below this ratio of depth to breadth a field counts as planar: 3 mm of relief on a board of 150 mm."""

_ITERATIONS = 20
_TOLERANCE = 1e-8
_CAUCHY = 2.0
_EXACT_MM = 1e-6
_STRAY = 6.0
_SAMPLES = 100


@dataclass(frozen=True, eq=False)
class DirectTransformation:
    """A solved DLT: ``L`` (3, 4), scaled so that its last entry is 1; ``K1`` per mm^2; the ``camera`` they describe.

    ``aspect`` is py/px as this camera's images show it (eq. 3.5), where the camera itself keeps the aspect
    that it was given; ``skew_deg`` is how far the axes of the plate miss a right angle.
    """

    L: Float
    K1: float
    camera: Camera
    aspect: float
    skew_deg: float


def refuse_unfit(points: ImagePoints, where: str) -> None:
    """Raise ``TooFewPointsError`` or ``PlanarFieldError`` for points that no single view can be solved with."""
    if len(points) < MIN_POINTS:
        raise TooFewPointsError(
            f"{where} has {len(points)} control points; at least {MIN_POINTS} that are well spread are needed"
        )
    if flatness(points.control_mm) < MIN_FLATNESS:
        raise PlanarFieldError(
            f"the control points of {where} lie in one plane or nearly so; use a field with pegs of different"
            " heights, or give several shots of the plane, tilted differently"
        )


def solve_dlt(points: ImagePoints, sensor: Sensor, where: str = "the image") -> DirectTransformation:
    """Return the DLT with K1 of at least 6 image points; distortion is found together with the eleven constants.

    With A = L9 X + L10 Y + L11 Z + 1, eq. 3.1 reads (x + (x - x0) K1 r^2) A = L1 X + ...: linear in L and K1
    once A, r and the principal point are taken from the round before; rows are divided by that A, so that
    residuals are measured on the plate. Departure: r is taken from the principal point.

    Raises ``TooFewPointsError``, ``PlanarFieldError``, ``MirroredFieldError``, ``ConvergenceError``.
    """
    refuse_unfit(points, where)
    solved = _best_round(points, sensor, where)
    if len(points) > 2 * MIN_POINTS and (solved is None or _has_strays(solved, points)):
        solved = _best_round(points.keep(_consensus(points, sensor)), sensor, where) or solved
    if solved is None:
        raise MirroredFieldError(
            f"{where} shows the control field mirrored: its coordinates must be right-handed, Z up to the"
            " cameras, and pixels count to the right and down; look for a reversed sign, or X and Y exchanged"
        )
    return solved


def _best_round(points: ImagePoints, sensor: Sensor, where: str) -> DirectTransformation | None:
    """Return the round that fits best, or None when all of them see a mirror image."""
    xy = sensor.camera().plate(points.pixels)
    T, X = _normalised(points.control_mm)
    best, least, rounds = None, np.inf, 0
    for P, K1 in _rounds(xy, X, sensor.plate_mm / 2):
        rounds += 1
        solved = _describe(P @ T, K1, points, sensor)
        if solved is None:
            continue
        miss = float(np.median(_miss(solved, points)))
        if best is None or miss < least:
            best, least = solved, miss
    if not rounds:
        raise ConvergenceError(
            f"the points of {where} do not determine a projection; spread them over the image"
        )
    return best


def _miss(solved: DirectTransformation, points: ImagePoints) -> Float:
    with np.errstate(all="ignore"):
        d = solved.camera.project(points.control_mm) - points.pixels
    return np.nan_to_num(np.hypot(d[:, 0], d[:, 1]), nan=np.inf)


def _has_strays(solved: DirectTransformation, points: ImagePoints) -> bool:
    miss = _miss(solved, points)
    return float(miss.max()) > _STRAY * float(np.median(miss))


def _consensus(points: ImagePoints, sensor: Sensor) -> NDArray[np.bool_]:
    """Return the points on which most agree: least median of squares over samples of 8, without distortion."""
    xy = sensor.camera().plate(points.pixels)
    _, X = _normalised(points.control_mm)
    rng = np.random.default_rng(0)  # the same samples for the same points
    best, least = np.ones(len(X), dtype=bool), np.inf
    for _ in range(_SAMPLES):
        chosen = rng.choice(len(X), 8, replace=False)
        zero = np.zeros_like(X[chosen])
        B = np.vstack([np.hstack([X[chosen], zero]), np.hstack([zero, X[chosen]])])
        B = np.hstack([B, -xy[chosen].T.ravel()[:, None] * np.tile(X[chosen][:, :3], (2, 1))])
        L = np.append(np.linalg.lstsq(B, xy[chosen].T.ravel(), rcond=None)[0], 1.0).reshape(3, 4)
        image = X @ L.T
        with np.errstate(all="ignore"):
            miss = np.hypot(*(image[:, :2] / image[:, 2:] - xy).T)
        median = float(np.median(miss))
        if median < least:
            best, least = miss < _STRAY * median, median
    return best


def _rounds(xy: Float, X: Float, half_plate: Float) -> Iterator[tuple[Float, float]]:
    """Yield the solution without distortion, and then with it after each round until it stands still."""
    principal, A, weight = np.zeros(2), np.ones(len(X)), np.ones(len(X))
    P = np.zeros((3, 4))
    for turn in range(_ITERATIONS):
        previous, (P, K1, weight) = P, _round(xy, X, weight / A, A, principal, distortion=turn > 0)
        A = X @ P[2]
        if not np.all(np.isfinite(P)) or np.ptp(np.sign(A)) > 0:
            return
        yield P, K1
        principal = np.clip(_principal_point(P), -half_plate, half_plate)
        if np.abs(P - previous).max() < _TOLERANCE * np.abs(P).max():
            return


def _round(
    xy: Float, X: Float, weight: Float, A: Float, principal: Float, *, distortion: bool
) -> tuple[Float, float, Float]:
    """Return L (3, 4), K1 and new weights (n,), which spare the points that fit badly (Cauchy)."""
    d = xy - principal
    r2 = (d * d).sum(axis=1)
    zero = np.zeros_like(X)
    rows = []
    for axis in range(2):
        numerator = (X, zero) if axis == 0 else (zero, X)
        radial = (-(d[:, axis] * r2 * A)[:, None],) if distortion else ()
        rows.append(np.hstack([*numerator, -xy[:, axis, None] * X[:, :3], *radial]))
    B, b, w = np.vstack(rows), xy.T.ravel(), np.tile(weight, 2)[:, None]
    scale = np.linalg.norm(w * B, axis=0)
    solution = np.linalg.lstsq(w * B / scale, w[:, 0] * b, rcond=None)[0] / scale
    L = np.append(solution[:11], 1.0).reshape(3, 4)
    miss = np.hypot(*((B @ solution - b).reshape(2, -1) / (X @ L[2])))
    spread = max(_CAUCHY * float(np.median(miss)), _EXACT_MM)
    K1 = float(solution[11]) if distortion else 0.0
    return L, K1, 1 / np.sqrt(1 + (miss / spread) ** 2)


def _normalised(points_mm: Float) -> tuple[Float, Float]:
    centre = points_mm.mean(axis=0)
    scale = np.abs(points_mm - centre).max()
    T = np.diag([1 / scale] * 3 + [1.0])
    T[:3, 3] = -centre / scale
    return T, np.column_stack([(points_mm - centre) / scale, np.ones(len(points_mm))])


def _principal_point(P: Float) -> Float:
    m1, m2, m3 = P[:, :3]
    return np.asarray(np.array([m1 @ m3, m2 @ m3]) / (m3 @ m3))


def _describe(P: Float, K1: float, points: ImagePoints, sensor: Sensor) -> DirectTransformation | None:
    """Split P into camera parameters: P ~ K M [1 | -X0] with K = [[-fx, s, x0], [0, -fy, y0], [0, 0, 1]].

    None when only a mirrored camera would do.
    """
    depth = np.column_stack([points.control_mm, np.ones(len(points))]) @ P[2]
    P = P / np.linalg.norm(P[2, :3]) * -np.sign(np.median(depth))  # points in view have Xc[2] < 0
    # P ~ K M is right-handed when its first two rows carry -f twice.
    if np.linalg.det(P[:, :3]) < 0:
        return None
    m1, m2, m3 = P[:, :3]
    x0, y0 = m1 @ m3, m2 @ m3
    a, b = -(m1 - x0 * m3), -(m2 - y0 * m3)
    fx, fy = np.linalg.norm(a), np.linalg.norm(b)
    skew = np.degrees(np.arcsin(np.clip(a @ b / (fx * fy), -1, 1)))
    M = _nearest_rotation(np.stack([a / fx, b / fy, m3]))
    centre = -np.linalg.solve(P[:, :3], P[:, 3])
    f = float(np.sqrt(fx * fy))
    camera = sensor.camera(
        (float(centre[0]), float(centre[1]), float(centre[2])),
        angles_of(M),
        f,
        (float(x0), float(y0)),
        (K1, 0.0),
    )
    px, py = sensor.pixel_size_mm
    return DirectTransformation(P / P[2, 3], K1, camera, float(py / px * fx / fy), float(skew))


def _nearest_rotation(A: Float) -> Float:
    U, _, Vt = np.linalg.svd(A)
    return np.asarray(U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt)


def angles_of(M: Float) -> tuple[float, float, float]:
    """Return (omega, phi, kappa) in degrees of a rotation matrix (eq. 5.4)."""
    omega, kappa = np.arctan2(-M[2, 1], M[2, 2]), np.arctan2(-M[1, 0], M[0, 0])
    phi = np.arctan2(M[2, 0], np.hypot(M[2, 1], M[2, 2]))
    return float(np.degrees(omega)), float(np.degrees(phi)), float(np.degrees(kappa))
