"""The collinearity equations (eq. 3.4) as functions of the parameters of a camera, with analytic derivatives."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.geometry.small_matrices import inverse_2x2

PARAMETER_NAMES = (
    "X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1", "K2", "P1", "P2", "aspect",
)  # fmt: skip
"""The 13 parameters of section 2.2 and the aspect py/px of eq. 3.5; mm, degrees, 1/mm^k."""

EXTERIOR_NAMES = PARAMETER_NAMES[:6]
"""Position and rotation of a camera: its exterior orientation."""

THESIS_NAMES = PARAMETER_NAMES[:13]
"""The parameters of section 2.2: all of a camera whose aspect is known."""

_ASPECT = PARAMETER_NAMES.index("aspect")


def camera_vector(camera: Camera) -> Float:
    """Return the parameters of a camera as a vector.

    Parameters
    ----------
    camera
        The camera.

    Returns
    -------
    Float
        Parameters in the order of `PARAMETER_NAMES`, shape (14,).
    """
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
    """Return the camera of a parameter vector, the inverse of `camera_vector`.

    Parameters
    ----------
    vector
        Parameters in the order of `PARAMETER_NAMES`, shape (14,).
    like
        Camera whose image size and pixel width are taken over.

    Returns
    -------
    Camera
        The camera.
    """
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
    """Return the pixels of object points and their derivatives.

    The image of a point is the root of the distortion equation; its derivatives follow from the implicit function
    theorem.

    Parameters
    ----------
    camera
        The camera.
    points_mm
        Points, shape (n, 3), object space, mm.
    near_px
        Initial values of the root, shape (n, 2), px; by default the undistorted images.

    Returns
    -------
    pixels : Float
        (u, v), shape (n, 2), px; NaN for points that are not in front of the camera.
    by_parameter : Float
        Derivatives with respect to the parameters, shape (n, 2, 14), px per unit of `PARAMETER_NAMES`.
    by_point : Float
        Derivatives with respect to the points, shape (n, 2, 3), px per mm.

    References
    ----------
    Thesis eqs 3.4 and 5.4. Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014), section 4.2.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, point = table_3_3_rig().left, np.array([[400.0, 400.0, 50.0]])
    >>> pixels, by_parameter, by_point = project_with_derivatives(camera, point)
    >>> bool(np.allclose(pixels, camera.project(point)))
    True
    >>> bool(np.allclose(by_parameter[:, :, :3], -by_point))
    True
    """
    pinhole = camera.pinhole
    points = np.where(pinhole.in_front(points_mm)[:, None], points_mm, np.nan)
    ideal, ideal_by_point = pinhole.project(points)
    plate = camera.distort(ideal, None if near_px is None else camera.plate(near_px))
    pixels = camera.pixels(plate)
    to_px = inverse_2x2(camera.undistortion_jacobian(pixels))
    by_point = to_px @ ideal_by_point
    J = np.zeros((len(points), 2, len(PARAMETER_NAMES)))
    J[:, :, :3] = -by_point
    axes = np.radians(1.0) * rotation_axes(np.array(camera.rotation_deg)) @ camera.M
    J[:, :, 3:6] = by_point @ (cross_matrix(points - pinhole.centre_mm) @ axes.T)
    J[:, :, 6] = (to_px @ (ideal / camera.focal_length_mm)[:, :, None])[:, :, 0]
    px, py = np.array(
        camera.pixel_size_mm
    )  # an iteration may reach an aspect of zero: infinite, not an error
    J[:, 0, 7], J[:, 1, 8] = 1 / px, -1 / py
    J[:, :, 9:13] = -to_px @ _distortion_derivatives(plate - camera.principal_point_mm)
    J[:, 1, _ASPECT] = plate[:, 1] / py * px / py
    return pixels, J, by_point


def rotation_axes(rotation_deg: Float) -> Float:
    """Return the axes of the successive rotations of a camera.

    Parameters
    ----------
    rotation_deg
        (omega, phi, kappa), shape (3,), degrees.

    Returns
    -------
    Float
        The axes a of omega, phi and kappa in rows, shape (3, 3), camera axes: ``dXc = Xc x a`` per radian.

    References
    ----------
    Thesis eq. 5.4.
    """
    _, phi, kappa = np.radians(rotation_deg)
    sk, ck, sp, cp = np.sin(kappa), np.cos(kappa), np.sin(phi), np.cos(phi)
    return np.array([[ck * cp, -sk * cp, sp], [sk, ck, 0.0], [0.0, 0.0, 1.0]])


def _distortion_derivatives(d: Float) -> Float:
    """Return the derivatives (n, 2, 4) of ideal offsets with respect to K1, K2, P1, P2, at measured offsets (n, 2)."""
    x, y = d[:, 0], d[:, 1]
    r2 = x * x + y * y
    L = np.empty((len(x), 2, 4))
    L[:, :, 0] = d * r2[:, None]
    L[:, :, 1] = L[:, :, 0] * r2[:, None]
    L[:, 0, 2], L[:, 1, 3] = r2 + 2 * x * x, r2 + 2 * y * y
    L[:, 1, 2] = L[:, 0, 3] = 2 * x * y
    return L
