"""The collinearity camera (thesis eq. 3.4) and the stereo rig; the only module that maps pixels to the plate.

Frames
------
object space
    mm, right-handed, Z up towards the cameras; defined by the calibration's control field.
camera space
    ``Xc = M (X - X0)`` with ``M = M_kappa M_phi M_omega`` (eq. 5.4); points in view have ``Xc[2] < 0``.
plate
    mm, x right, y up, origin at the image centre ``((W-1)/2, (H-1)/2)``.
pixels
    u right, v down; an integer value is the centre of a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from spinewatch.arrays import Float
from spinewatch.geometry.projection import Pinhole
from spinewatch.geometry.rays import Rays, axes_approach_mm
from spinewatch.geometry.rotations import angles_from_rotation, rotation_from_angles, rotation_from_vector

_MAX_NEWTON_STEPS = 30
_NEWTON_TOLERANCE_MM = 1e-15


@dataclass(frozen=True, eq=False)
class Camera:
    """One calibrated camera.

    Attributes
    ----------
    position_mm
        Perspective centre (X0, Y0, Z0), object space, mm.
    rotation_deg
        (omega, phi, kappa), degrees.
    focal_length_mm
        f, mm.
    principal_point_mm
        (x0, y0) on the plate, mm.
    radial
        K1 per mm^2, K2 per mm^4.
    decentering
        P1, P2 per mm.
    image_size_px
        (W, H), px.
    pixel_size_mm
        (px, py), width and height of a pixel on the plate, mm.
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
        """Rotation from object axes to camera axes, shape (3, 3)."""
        return rotation_from_angles(*self.rotation_deg)

    @cached_property
    def centre(self) -> Float:
        """Perspective centre, shape (3,), object space, mm."""
        return np.array(self.position_mm)

    @cached_property
    def pinhole(self) -> Pinhole:
        """The camera's central projection, without pixels and lens distortion."""
        return Pinhole(self.centre, self.M, self.focal_length_mm)

    def plate(self, pixels: ArrayLike) -> Float:
        """Return the plate coordinates of pixels.

        Parameters
        ----------
        pixels
            (u, v), shape (..., 2), px.

        Returns
        -------
        Float
            (x, y), shape (..., 2), plate, mm.
        """
        uv = np.asarray(pixels, dtype=np.float64)
        (w, h), (px, py) = self.image_size_px, self.pixel_size_mm
        return (uv - ((w - 1) / 2, (h - 1) / 2)) * (px, -py)

    def pixels(self, plate: ArrayLike) -> Float:
        """Return the pixels of plate coordinates.

        Parameters
        ----------
        plate
            (x, y), shape (..., 2), plate, mm.

        Returns
        -------
        Float
            (u, v), shape (..., 2), px.
        """
        xy = np.asarray(plate, dtype=np.float64)
        (w, h), (px, py) = self.image_size_px, self.pixel_size_mm
        return xy / (px, -py) + ((w - 1) / 2, (h - 1) / 2)

    def undistort(self, plate: ArrayLike) -> Float:
        """Return ideal offsets from the principal point: the left side of eq. 3.4.

        Parameters
        ----------
        plate
            Measured points, shape (..., 2), plate, mm.

        Returns
        -------
        Float
            Undistorted offsets, shape (..., 2), mm.

        References
        ----------
        Thesis eq. 3.4. There r is measured from the origin of the plate, here from the principal point, which is
        how a lens distorts; with Table 3.3 they differ by up to 0.66 px.
        """
        d = np.asarray(plate, dtype=np.float64) - self.principal_point_mm
        return _correct(d, self.radial, self.decentering)

    def undistortion_jacobian(self, pixels: ArrayLike) -> Float:
        """Return the derivatives of ideal offsets with respect to pixels.

        Parameters
        ----------
        pixels
            (u, v), shape (..., 2), px.

        Returns
        -------
        Float
            d(ideal)/d(pixel), shape (..., 2, 2), mm per px.
        """
        return self._pixel_jacobian(self.plate(pixels) - self.principal_point_mm)

    def _pixel_jacobian(self, d: Float) -> Float:
        """Return d(ideal)/d(pixel), shape (..., 2, 2), at offsets (..., 2) from the principal point."""
        px, py = self.pixel_size_mm
        return np.asarray(_correct_jacobian(d, self.radial, self.decentering) * np.array([px, -py]))

    def distort(self, ideal: ArrayLike, near: ArrayLike | None = None) -> Float:
        """Return measured plate points of ideal offsets, the inverse of `undistort`, by Newton's method.

        Parameters
        ----------
        ideal
            Undistorted offsets from the principal point, shape (..., 2), mm.
        near
            Initial values on the plate, shape (..., 2), mm; by default the ideal points.

        Returns
        -------
        Float
            Measured points, shape (..., 2), plate, mm; NaN beyond the fold of the distortion model, where a point
            has no image.
        """
        target = np.asarray(ideal, dtype=np.float64)
        d = target.copy() if near is None else np.asarray(near, dtype=np.float64) - self.principal_point_mm
        for _ in range(_MAX_NEWTON_STEPS):
            residual = _correct(d, self.radial, self.decentering) - target
            step = _solve_2x2(_correct_jacobian(d, self.radial, self.decentering), residual)
            d = d - step
            if not np.any(np.abs(step) > _NEWTON_TOLERANCE_MM):
                break
        residual = _correct(d, self.radial, self.decentering) - target
        J = _correct_jacobian(d, self.radial, self.decentering)
        det = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
        folded = ~(det > 0) | ~(np.abs(residual).max(axis=-1) < 1e-9)
        d[folded] = np.nan
        return d + self.principal_point_mm

    def project(self, points_mm: ArrayLike) -> Float:
        """Return the pixels of object points.

        Parameters
        ----------
        points_mm
            Points, shape (..., 3), object space, mm.

        Returns
        -------
        Float
            (u, v), shape (..., 2), px; NaN for points that are not in front of the camera.
        """
        X = np.asarray(points_mm, dtype=np.float64)
        in_front = self.pinhole.in_front(X)
        ideal, _ = self.pinhole.project(np.where(in_front[..., None], X, np.nan))
        return self.pixels(self.distort(ideal))

    def projection_jacobian(self, points_mm: ArrayLike) -> Float:
        """Return the derivatives of pixels with respect to object points.

        Parameters
        ----------
        points_mm
            Points, shape (..., 3), object space, mm.

        Returns
        -------
        Float
            d(pixel)/d(point), shape (..., 2, 3), px per mm.
        """
        ideal, J = self.pinhole.project(np.asarray(points_mm, dtype=np.float64))
        measured = self.distort(ideal) - self.principal_point_mm
        d_measured = np.linalg.inv(_correct_jacobian(measured, self.radial, self.decentering))
        px, py = self.pixel_size_mm
        return np.array([[1 / px], [-1 / py]]) * (d_measured @ J)

    def directions(self, pixels: ArrayLike) -> Float:
        """Return the directions of the rays through pixels.

        Parameters
        ----------
        pixels
            (u, v), shape (..., 2), px.

        Returns
        -------
        Float
            Unit vectors away from the camera, shape (..., 3), object axes.
        """
        d = self.pinhole.rays(self.undistort(self.plate(pixels)))
        return np.asarray(d / np.linalg.norm(d, axis=-1, keepdims=True))

    def rays(self, pixels: ArrayLike, covariance_px2: ArrayLike, extra_sd_mrad: float = 0.0) -> Rays:
        """Return the rays through pixels with their uncertainty.

        Parameters
        ----------
        pixels
            (u, v), shape (n, 2), px.
        covariance_px2
            Covariances of the pixels, shape (n, 2, 2) or (2, 2), px^2.
        extra_sd_mrad
            Pointing error per axis, mrad, added in square to the uncertainty of the pixels.

        Returns
        -------
        Rays
            n rays.
        """
        d = self.plate(pixels) - self.principal_point_mm
        ideal = _correct(d, self.radial, self.decentering)
        J = self._pixel_jacobian(d)
        extra_mm = self.focal_length_mm * extra_sd_mrad / 1000
        S = J @ np.asarray(covariance_px2) @ np.swapaxes(J, -1, -2) + extra_mm**2 * np.eye(2)
        return Rays(self.pinhole, ideal, S, self.pinhole.rays(ideal))

    def moved(self, rotation_rad: Float, shift_mm: Float) -> Camera:
        """Return the camera after a small motion in its own axes.

        Parameters
        ----------
        rotation_rad
            Rotation vector, shape (3,), camera axes, radians.
        shift_mm
            Displacement of the perspective centre, shape (3,), camera axes, mm.

        Returns
        -------
        Camera
            The same camera in its new position.
        """
        centre = self.centre + self.M.T @ shift_mm
        return replace(
            self,
            position_mm=(float(centre[0]), float(centre[1]), float(centre[2])),
            rotation_deg=angles_from_rotation(rotation_from_vector(rotation_rad) @ self.M),
        )

    def depth_mm(self, point_mm: ArrayLike) -> float:
        """Return the depth of a point along the optical axis.

        Parameters
        ----------
        point_mm
            Point, shape (3,), object space, mm.

        Returns
        -------
        float
            Distance from the perspective centre along the axis, mm, positive in front of the camera.
        """
        return float(-self.M[2] @ (np.asarray(point_mm, dtype=np.float64) - self.centre))

    def ball_diameter_px(self, diameter_mm: float, range_mm: float) -> tuple[float, float]:
        """Return the size of a ball's image near the image centre.

        Parameters
        ----------
        diameter_mm
            Diameter of the ball, mm.
        range_mm
            Its depth along the optical axis, mm.

        Returns
        -------
        tuple of float
            Width and height, px.
        """
        on_plate = diameter_mm * self.focal_length_mm / range_mm
        px, py = self.pixel_size_mm
        return on_plate / px, on_plate / py


@dataclass(frozen=True, eq=False)
class Rig:
    """Two calibrated cameras that look at the same object space; left has the smaller X0.

    Attributes
    ----------
    name
        Name of the rig.
    left, right
        The cameras.
    """

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

    @property
    def axes_approach_mm(self) -> tuple[float, float] | None:
        """Depths of the point where the optical axes come nearest to each other, left and right, mm, or None."""
        return axes_approach_mm(self.left.pinhole, self.right.pinhole)


def undistorted(
    offsets_mm: Float, r2_mm2: Float, radial: tuple[float, float], decentering: tuple[float, float]
) -> Float:
    """Return measured offsets from the principal point without lens distortion.

    Parameters
    ----------
    offsets_mm
        Measured offsets, shape (..., 2), plate, mm.
    r2_mm2
        Squared distances from the centre of the distortion, shape (...), mm^2.
    radial
        K1, mm^-2, and K2, mm^-4.
    decentering
        P1 and P2, mm^-1.

    Returns
    -------
    Float
        Ideal offsets, shape (..., 2), mm.

    References
    ----------
    Thesis eq. 3.4.
    """
    x, y = offsets_mm[..., 0], offsets_mm[..., 1]
    (K1, K2), (P1, P2) = radial, decentering
    scale = 1 + r2_mm2 * (K1 + r2_mm2 * K2)
    ideal = np.empty_like(offsets_mm)
    ideal[..., 0] = x * scale + P1 * (r2_mm2 + 2 * x * x) + 2 * P2 * x * y
    ideal[..., 1] = y * scale + P2 * (r2_mm2 + 2 * y * y) + 2 * P1 * x * y
    return ideal


def _correct(d: Float, radial: tuple[float, float], decentering: tuple[float, float]) -> Float:
    """Return offsets (..., 2) without a distortion about the principal point."""
    return undistorted(d, d[..., 0] * d[..., 0] + d[..., 1] * d[..., 1], radial, decentering)


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
