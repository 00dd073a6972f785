"""The collinearity camera (thesis eq. 3.4) and the stereo rig; the only place that knows pixels from plate.

Frames
------
object space
    mm, right-handed, Z up towards the cameras; whatever the calibration's control field defined.
camera space
    ``Xc = M (X - X0)`` with ``M = M_kappa M_phi M_omega`` (eq. 5.4); points in view have ``Xc[2] < 0``.
plate
    mm, x right, y up, origin at the image centre ``((W-1)/2, (H-1)/2)``.
pixels
    u right, v down, an integer value is the centre of a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spinewatch.errors import ParameterError

Float = NDArray[np.float64]

_NEWTON_STEPS = 30
_NEWTON_TOLERANCE_MM = 1e-15


def rotation_matrix(omega_deg: float, phi_deg: float, kappa_deg: float) -> Float:
    """Return ``M = M_kappa M_phi M_omega`` (3, 3), object to camera axes, of angles in degrees (eq. 5.4)."""
    (so, sp, sk), (co, cp, ck) = (f(np.radians([omega_deg, phi_deg, kappa_deg])) for f in (np.sin, np.cos))
    return np.array(
        [
            [cp * ck, co * sk + so * sp * ck, so * sk - co * sp * ck],
            [-cp * sk, co * ck - so * sp * sk, so * ck + co * sp * sk],
            [sp, -so * cp, co * cp],
        ]
    )


def degrees_from_dms(packed: float) -> float:
    """Return decimal degrees of an angle packed as DDDMMSS.s, the notation of Table 3.3.

    Raises ``ParameterError`` when the minutes or seconds are not below 60.
    """
    degrees, rest = divmod(abs(packed), 10_000)
    minutes, seconds = divmod(rest, 100)
    if minutes >= 60 or seconds >= 60:
        raise ParameterError(f"{packed} is not an angle in DDDMMSS.s: minutes and seconds must be below 60")
    return float(np.copysign(degrees + minutes / 60 + seconds / 3600, packed))


@dataclass(frozen=True, eq=False)
class Camera:
    """One calibrated camera; every attribute is named with its unit.

    ``position_mm`` (X0, Y0, Z0); ``rotation_deg`` (omega, phi, kappa); ``principal_point_mm`` (x0, y0) on the
    plate; ``radial`` (K1 per mm^2, K2 per mm^4); ``decentering`` (P1, P2 per mm); ``image_size_px`` (W, H);
    ``pixel_size_mm`` (px, py).
    """

    position_mm: tuple[float, float, float]
    rotation_deg: tuple[float, float, float]
    focal_length_mm: float
    principal_point_mm: tuple[float, float]
    radial: tuple[float, float]
    decentering: tuple[float, float]
    image_size_px: tuple[int, int]
    pixel_size_mm: tuple[float, float]

    @cached_property
    def M(self) -> Float:  # noqa: N802
        """Rotation (3, 3) from object to camera axes."""
        return rotation_matrix(*self.rotation_deg)

    @cached_property
    def centre(self) -> Float:
        """Perspective centre (3,) in object space, mm."""
        return np.array(self.position_mm)

    def plate(self, pixels: ArrayLike) -> Float:
        """Return plate coordinates (..., 2) in mm of pixels (..., 2)."""
        uv = np.asarray(pixels, dtype=np.float64)
        (w, h), (px, py) = self.image_size_px, self.pixel_size_mm
        return (uv - ((w - 1) / 2, (h - 1) / 2)) * (px, -py)

    def pixels(self, plate: ArrayLike) -> Float:
        """Return pixels (..., 2) of plate coordinates (..., 2) in mm."""
        xy = np.asarray(plate, dtype=np.float64)
        (w, h), (px, py) = self.image_size_px, self.pixel_size_mm
        return xy / (px, -py) + ((w - 1) / 2, (h - 1) / 2)

    def undistort(self, plate: ArrayLike) -> Float:
        """Return ideal offsets (..., 2) in mm from the principal point, of measured plate points (..., 2).

        The left side of eq. 3.4. Here r is taken from the principal point, where the thesis takes it from the
        plate's origin: that is what the lens does, and they differ by up to half a pixel.
        """
        d = np.asarray(plate, dtype=np.float64) - self.principal_point_mm
        return _correct(d, self.radial, self.decentering)

    def undistortion_jacobian(self, pixels: ArrayLike) -> Float:
        """Return d(ideal offset)/d(pixel), (..., 2, 2) in mm per px, at pixels (..., 2)."""
        d = self.plate(pixels) - self.principal_point_mm
        px, py = self.pixel_size_mm
        return np.asarray(_correct_jacobian(d, self.radial, self.decentering) * np.array([px, -py]))

    def distort(self, ideal: ArrayLike, near: ArrayLike | None = None) -> Float:
        """Return measured plate points (..., 2) of ideal offsets (..., 2), both in mm; inverse of ``undistort``.

        Newton's method on the plate, from plate points ``near`` the result where they are known. Points
        beyond the fold of the distortion model have no image: NaN.
        """
        target = np.asarray(ideal, dtype=np.float64)
        d = target.copy() if near is None else np.asarray(near, dtype=np.float64) - self.principal_point_mm
        for _ in range(_NEWTON_STEPS):
            miss = _correct(d, self.radial, self.decentering) - target
            step = _solve_2x2(_correct_jacobian(d, self.radial, self.decentering), miss)
            d = d - step
            if not np.any(np.abs(step) > _NEWTON_TOLERANCE_MM):
                break
        miss = _correct(d, self.radial, self.decentering) - target
        J = _correct_jacobian(d, self.radial, self.decentering)
        det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
        folded = ~(det > 0) | ~(np.abs(miss).max(axis=-1) < 1e-9)
        d[folded] = np.nan
        return d + self.principal_point_mm

    def project(self, points_mm: ArrayLike) -> Float:
        """Return pixels (..., 2) of object points (..., 3) in mm; NaN for points not in front of the camera."""
        Xc = (np.asarray(points_mm, dtype=np.float64) - self.centre) @ self.M.T
        depth = np.where(Xc[..., 2] < 0, Xc[..., 2], np.nan)
        ideal = -self.focal_length_mm * Xc[..., :2] / depth[..., None]
        return self.pixels(self.distort(ideal))

    def directions(self, pixels: ArrayLike) -> Float:
        """Return unit directions (..., 3) in object space of the rays through pixels (..., 2), away from the camera."""
        ideal = self.undistort(self.plate(pixels))
        V = np.concatenate([ideal, np.full((*ideal.shape[:-1], 1), -self.focal_length_mm)], axis=-1)
        d = V @ self.M  # rows of V times M is M^T V, eq. 3.2
        return np.asarray(d / np.linalg.norm(d, axis=-1, keepdims=True))

    def projection_jacobian(self, points_mm: ArrayLike) -> Float:
        """Return d(pixel)/d(point), (..., 2, 3) in px per mm, at object points (..., 3)."""
        X = np.asarray(points_mm, dtype=np.float64)
        Xc = (X - self.centre) @ self.M.T
        f, z = self.focal_length_mm, Xc[..., 2]
        ideal = -f * Xc[..., :2] / z[..., None]
        d_ideal = np.zeros((*z.shape, 2, 3))
        d_ideal[..., 0, 0] = d_ideal[..., 1, 1] = -f / z
        d_ideal[..., :, 2] = -ideal / z[..., None]
        measured = self.distort(ideal) - self.principal_point_mm
        d_measured = np.linalg.inv(_correct_jacobian(measured, self.radial, self.decentering))
        px, py = self.pixel_size_mm
        return np.array([[1 / px], [-1 / py]]) * (d_measured @ d_ideal @ self.M)

    def depth_mm(self, point_mm: ArrayLike) -> float:
        """Return the distance (mm) of an object point (3,) from the perspective centre along the optical axis."""
        return float(-self.M[2] @ (np.asarray(point_mm, dtype=np.float64) - self.centre))

    def ball_diameter_px(self, diameter_mm: float, range_mm: float) -> tuple[float, float]:
        """Return the (width, height) in pixels of a ball's image near the centre, at a range along the axis."""
        on_plate = diameter_mm * self.focal_length_mm / range_mm
        px, py = self.pixel_size_mm
        return on_plate / px, on_plate / py


@dataclass(frozen=True, eq=False)
class Rig:
    """Two calibrated cameras that look at the same object space; left has the smaller X0."""

    name: str
    left: Camera
    right: Camera

    @property
    def baseline_mm(self) -> float:
        """Distance between the perspective centres, mm."""
        return float(np.linalg.norm(self.right.centre - self.left.centre))

    @property
    def vergence_deg(self) -> float:
        """Angle between the optical axes, degrees."""
        return float(np.degrees(np.arccos(np.clip(self.left.M[2] @ self.right.M[2], -1, 1))))


def _correct(d: Float, radial: tuple[float, float], decentering: tuple[float, float]) -> Float:
    x, y = d[..., 0], d[..., 1]
    (K1, K2), (P1, P2) = radial, decentering
    r2 = x * x + y * y
    scale = 1 + r2 * (K1 + r2 * K2)
    ideal = np.empty_like(d)
    ideal[..., 0] = x * scale + P1 * (r2 + 2 * x * x) + 2 * P2 * x * y
    ideal[..., 1] = y * scale + P2 * (r2 + 2 * y * y) + 2 * P1 * x * y
    return ideal


def _correct_jacobian(d: Float, radial: tuple[float, float], decentering: tuple[float, float]) -> Float:
    x, y = d[..., 0], d[..., 1]
    (K1, K2), (P1, P2) = radial, decentering
    r2 = x * x + y * y
    scale, slope = 1 + r2 * (K1 + r2 * K2), 2 * (K1 + 2 * r2 * K2)
    J = np.empty((*x.shape, 2, 2))
    J[..., 0, 0] = scale + slope * x * x + 6 * P1 * x + 2 * P2 * y
    J[..., 1, 1] = scale + slope * y * y + 6 * P2 * y + 2 * P1 * x
    J[..., 0, 1] = J[..., 1, 0] = slope * x * y + 2 * P1 * y + 2 * P2 * x
    return J


def _solve_2x2(J: Float, b: Float) -> Float:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
        x = np.empty_like(b)
        x[..., 0] = (J[..., 1, 1] * b[..., 0] - J[..., 0, 1] * b[..., 1]) / det
        x[..., 1] = (J[..., 0, 0] * b[..., 1] - J[..., 1, 0] * b[..., 0]) / det
        return x
