"""Tsai's two-stage calibration from a non-coplanar field (IEEE J. Robotics and Automation, 1987)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import angles_from_rotation, nearest_rotation


def tsai_two_stage(points: ImagePoints, sensor: Sensor, *, use_scale: bool = False) -> Camera:
    """Return a camera by the radial alignment constraint, then f, Tz and K1; the principal point is the centre.

    Stage 1 gives the horizontal scale sx of the sensor too, by which the width of its pixels is divided on request.
    Stage 1 is linear in seven unknowns: a point and its image lie on one radius from the centre, whatever the
    distortion and focal length. Stage 2 is linear without distortion, then adjusts three unknowns.
    """
    xy = sensor.camera().plate(points.pixels)
    X = points.control_mm
    x, y = xy.T
    A = np.column_stack([y[:, None] * X, y, -x[:, None] * X])
    scale = np.linalg.norm(A, axis=0)
    a = np.linalg.lstsq(A / scale, x, rcond=None)[0] / scale
    ty = 1 / float(np.linalg.norm(a[4:7]))
    M, T = _orientation(a, ty)
    far = int(np.argmax((xy**2).sum(axis=1)))
    if (M[0] @ X[far] + T[0]) * x[far] < 0 or (M[1] @ X[far] + T[1]) * y[far] < 0:
        M, T = _orientation(a, -ty)
    if use_scale:
        sx = float(np.linalg.norm(a[:3])) * ty
        sensor = Sensor(sensor.image_size_px, (sensor.pixel_size_mm[0] / sx, sensor.pixel_size_mm[1]))
        xy = sensor.camera().plate(points.pixels)
    across = X @ M[:2].T + T
    along = X @ M[2]  # Xc[2] = along + Tz, negative in view
    B = np.column_stack([-across.T.ravel(), -xy.T.ravel()])
    f, tz = np.linalg.lstsq(B, (xy * along[:, None]).T.ravel(), rcond=None)[0]
    if f < 0:
        f, tz = -f, -tz

    def camera(v: Float) -> Camera:
        centre = -M.T @ np.array([T[0], T[1], v[1]])
        return sensor.camera(
            (float(centre[0]), float(centre[1]), float(centre[2])),
            angles_from_rotation(M),
            float(v[0]),
            radial=(float(v[2]), 0.0),
        )

    def residuals(v: Float) -> Float:
        ideal = xy * (1 + v[2] * (xy**2).sum(axis=1, keepdims=True))
        return np.asarray((ideal + v[0] * across / (along + v[1])[:, None]).ravel())

    return camera(least_squares(residuals, np.array([f, tz, 0.0]), x_scale="jac").x)


def _orientation(a: Float, ty: float) -> tuple[Float, Float]:
    """Return M (3, 3) and (Tx, Ty) from the seven constants and the sign and size of Ty."""
    sx = np.linalg.norm(a[:3]) * abs(ty)
    r1, r2 = a[:3] * ty / sx, a[4:7] * ty
    return nearest_rotation(np.stack([r1, r2, np.cross(r1, r2)])), np.array([a[3] * ty / sx, ty])
