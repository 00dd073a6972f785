"""The collinearity equations (eq. 3.4) as functions of a camera's parameters, with analytic derivatives."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera

NAMES = ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1", "K2", "P1", "P2", "aspect")
"""The 13 parameters of section 2.2 and the aspect py/px of eq. 3.5; mm, degrees, 1/mm^k."""

EXTERIOR = NAMES[:6]
COUNT = len(NAMES)
_ASPECT = NAMES.index("aspect")


def camera_vector(camera: Camera) -> Float:
    """Return the parameters (14,) of a camera in the order of ``NAMES``."""
    px, py = camera.pixel_size_mm
    return np.array(
        [
            *camera.position_mm,
            *camera.rotation_deg,
            camera.focal_length_mm,
            *camera.principal_point_mm,
            *camera.radial,
            *camera.decentering,
            py / px,
        ]
    )


def camera_from_vector(vector: Float, like: Camera) -> Camera:
    """Return the camera of parameters (14,), with the image size and pixel width of ``like``."""
    v = [float(x) for x in vector]
    px = like.pixel_size_mm[0]
    return Camera(
        position_mm=(v[0], v[1], v[2]),
        rotation_deg=(v[3], v[4], v[5]),
        focal_length_mm=v[6],
        principal_point_mm=(v[7], v[8]),
        radial=(v[9], v[10]),
        decentering=(v[11], v[12]),
        image_size_px=like.image_size_px,
        pixel_size_mm=(px, v[_ASPECT] * px),
    )


def project_with_derivatives(
    camera: Camera, points_mm: Float, near_px: Float | None = None
) -> tuple[Float, Float, Float]:
    """Return pixels (n, 2) of object points (n, 3), and their derivatives by parameters and by point.

    The derivatives are (n, 2, 14) in px per unit of ``NAMES`` and (n, 2, 3) in px per mm. NaN where the
    camera does not see the point. The image is the root of the distortion equation, found the sooner from
    pixels ``near_px`` (n, 2); its derivatives follow from the implicit function theorem.
    """
    M, f = camera.M, camera.focal_length_mm
    Xc = (points_mm - camera.centre) @ M.T
    z = np.where(Xc[:, 2] < 0, Xc[:, 2], np.nan)
    ideal = -f * Xc[:, :2] / z[:, None]
    plate = camera.distort(ideal, None if near_px is None else camera.plate(near_px))
    pixels = camera.pixels(plate)
    to_px = _inverse_2x2(camera.undistortion_jacobian(pixels))
    by_Xc = np.zeros((len(z), 2, 3))
    by_Xc[:, 0, 0] = by_Xc[:, 1, 1] = -f / z
    by_Xc[:, :, 2] = -ideal / z[:, None]
    by_Xc = to_px @ by_Xc
    by_point = by_Xc @ M
    J = np.zeros((len(z), 2, COUNT))
    J[:, :, :3] = -by_point
    J[:, :, 3:6] = by_Xc @ _turn_derivatives(camera, Xc)
    J[:, :, 6] = (to_px @ (ideal / f)[:, :, None])[:, :, 0]
    px, py = np.array(camera.pixel_size_mm)  # an aspect of zero, on the way, is no error but infinite
    J[:, 0, 7], J[:, 1, 8] = 1 / px, -1 / py
    J[:, :, 9:13] = -to_px @ _lens_derivatives(plate - camera.principal_point_mm)
    J[:, 1, _ASPECT] = plate[:, 1] / py * px / py
    return pixels, J, by_point


def turn_axes(rotation_deg: Float) -> Float:
    """Return in rows the axes, in camera space, about which omega, phi and kappa turn the points (eq. 5.4)."""
    _, phi, kappa = np.radians(rotation_deg)
    sk, ck, sp, cp = np.sin(kappa), np.cos(kappa), np.sin(phi), np.cos(phi)
    return np.array([[ck * cp, -sk * cp, sp], [sk, ck, 0.0], [0.0, 0.0, 1.0]])


def _turn_derivatives(camera: Camera, Xc: Float) -> Float:
    """Return dXc (n, 3, 3) by omega, phi and kappa, per degree."""
    x, y, z = Xc.T
    turned = np.empty((len(x), 3, 3))
    for i, (a, b, c) in enumerate(np.radians(1.0) * turn_axes(np.array(camera.rotation_deg))):
        turned[:, 0, i], turned[:, 1, i], turned[:, 2, i] = y * c - z * b, z * a - x * c, x * b - y * a
    return turned


def _lens_derivatives(d: Float) -> Float:
    """Return the derivatives (n, 2, 4) of the ideal offset by K1, K2, P1 and P2, at measured offsets (n, 2)."""
    x, y = d[:, 0], d[:, 1]
    r2 = x * x + y * y
    L = np.empty((len(x), 2, 4))
    L[:, :, 0] = d * r2[:, None]
    L[:, :, 1] = L[:, :, 0] * r2[:, None]
    L[:, 0, 2], L[:, 1, 3] = r2 + 2 * x * x, r2 + 2 * y * y
    L[:, 1, 2] = L[:, 0, 3] = 2 * x * y
    return L


def _inverse_2x2(A: Float) -> Float:
    a, b, c, d = A[:, 0, 0], A[:, 0, 1], A[:, 1, 0], A[:, 1, 1]
    inverse = np.empty_like(A)
    inverse[:, 0, 0], inverse[:, 0, 1], inverse[:, 1, 0], inverse[:, 1, 1] = d, -b, -c, a
    inverse /= (a * d - b * c)[:, None, None]
    return inverse
