"""OpenPTV's ``.ori`` and ``.addpar`` files, for cameras in air.

``.ori``: X0 Y0 Z0 / omega phi kappa in radians / the transposed rotation matrix / xh yh / cc / glass vector.
``.addpar``: k1 k2 k3 p1 p2 scale shear.

OpenPTV distorts ideal points about the origin of the plate, collinearity (eq. 3.4) corrects measured points about the
principal point, so one model is fitted to the other over the image. OpenPTV's pixels start at the corner of the first
pixel and its image centre is W/2; the two differences cancel, so plate coordinates are the same.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.errors import RigError
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.numbers import NumberTextError, parse_number
from spinewatch.rig_plausibility import pixel_grid

_GRID = 21
_ORI, _ADDPAR = 21, 7
_MAX_MATRIX_DIFFERENCE = 1e-4
_SCALES = (0.5, 2.0)
_MIN_GLASS_MM = 1.0


def parse_openptv(
    ori: str, addpar: str, image_size_px: tuple[int, int], pixel_size_mm: tuple[float, float]
) -> tuple[Camera, float]:
    """Return the camera of an .ori and an .addpar file.

    The rotation is taken from the angles; the matrix must agree with them. The glass is ignored: refraction is not
    modelled (`glass_warning`).

    Parameters
    ----------
    ori
        Text of the .ori file.
    addpar
        Text of the .addpar file.
    image_size_px
        (W, H), px.
    pixel_size_mm
        (px, py), mm.

    Returns
    -------
    camera : Camera
        The camera.
    fit_error_px : float
        Maximum error of the fitted distortion over the image, px.

    Raises
    ------
    RigError
        If a file has a wrong number of entries or entries that are not finite numbers, or if its angles and its matrix
        contradict each other.

    References
    ----------
    OpenPTV liboptv, calibration.c and trafo.c.
    """
    o, a = _numbers(ori, _ORI, "ori"), _numbers(addpar, _ADDPAR, "addpar")
    if o[17] <= 0:
        raise RigError("ori.cc", "must be positive")
    if not _SCALES[0] <= a[5] <= _SCALES[1]:
        raise RigError("addpar", f"has a scale of {a[5]:g}; it is near 1 (k1 k2 k3 p1 p2 scale shear)")
    omega, phi, kappa = _angles_deg(o[3:6], np.reshape(o[6:15], (3, 3)))
    start = Camera(
        (o[0], o[1], o[2]),
        (omega, phi, kappa),
        o[17],
        (o[15], o[16]),
        (0.0, 0.0),
        (0.0, 0.0),
        image_size_px,
        pixel_size_mm,
    )
    corner = np.hypot(*(np.array(image_size_px) * pixel_size_mm)) / 2
    side = np.linspace(-1.0, 1.0, _GRID)
    x, y = np.meshgrid(
        side * start.image_size_px[0] * pixel_size_mm[0] / 2, side * image_size_px[1] * pixel_size_mm[1] / 2
    )
    ideal = np.stack([x.ravel(), y.ravel()], axis=1)
    measured = _distort(ideal, np.array(a))
    return _fitted(start, ideal - (o[15], o[16]), measured, float(corner))


def glass_warning(ori: str) -> str | None:
    """Return a warning about a glass wall in an .ori file, which is ignored.

    Parameters
    ----------
    ori
        Text of the .ori file.

    Returns
    -------
    str or None
        The warning; None for a camera without a glass wall.

    Raises
    ------
    RigError
        If the file has a wrong number of entries, or entries that are not finite numbers.
    """
    distance = math.hypot(*_numbers(ori, _ORI, "ori")[18:])
    if distance <= _MIN_GLASS_MM:
        return None
    return (
        f"the glass wall at {distance:.4g} mm is ignored: refraction is not modelled, and the rig is only right when"
        " cameras and markers are in air"
    )


def format_openptv(camera: Camera) -> tuple[str, str, float]:
    """Return the texts of the .ori and .addpar files of a camera.

    The glass vector has a direction but almost no length; with equal refractive indices it has no effect.

    Parameters
    ----------
    camera
        The camera.

    Returns
    -------
    ori : str
        Text of the .ori file.
    addpar : str
        Text of the .addpar file.
    fit_error_px : float
        Maximum error of the fitted distortion over the image, px.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> camera = large_rig().left
    >>> ori, addpar, _ = format_openptv(camera)
    >>> again, _ = parse_openptv(ori, addpar, camera.image_size_px, camera.pixel_size_mm)
    >>> abs(again.focal_length_mm - camera.focal_length_mm) < 1e-6
    True
    """
    plate = camera.plate(pixel_grid(camera.image_size_px, _GRID))
    ideal = camera.undistort(plate)
    x0, y0 = camera.principal_point_mm
    unit = float(np.abs(plate).max())
    powers = np.array([unit**-2, unit**-4, unit**-6, unit**-1, unit**-1, 1.0, 1.0])
    px = np.array(camera.pixel_size_mm)

    def parameters(v: Float) -> tuple[Float, Float]:
        return np.array([0, 0, 0, 0, 0, 1.0, 0.0]) + v[:7] * powers, np.array([x0, y0]) + v[7:]

    def residuals(v: Float) -> Float:
        added, shift = parameters(v)
        return np.asarray(((_distort(ideal + shift, added) - plate) / px).ravel())

    v = np.asarray(least_squares(residuals, np.zeros(9), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14).x)
    added, shift = parameters(v)
    error = float(np.linalg.norm(residuals(v).reshape(-1, 2), axis=1).max())
    rows = [
        " ".join(f"{c:.8f}" for c in camera.position_mm),
        " ".join(f"{math.radians(c):.10f}" for c in camera.rotation_deg),
        "",
        *(" ".join(f"{c:.7f}" for c in row) for row in camera.M.T),
        "",
        f"{shift[0]:.8f} {shift[1]:.8f}",
        f"{camera.focal_length_mm:.8f}",
        "",
        "0.000000000000001 0.000000000000001 1.000000000000000",
    ]
    return "\n".join(rows) + "\n", " ".join(f"{c:.12g}" for c in added) + "\n", error


def _angles_deg(angles_rad: list[float], transposed: Float) -> tuple[float, float, float]:
    """Return (omega, phi, kappa) in degrees of the angles of a file; its matrix M^T (3, 3) must agree."""
    omega, phi, kappa = (_within_a_turn(math.degrees(x)) for x in angles_rad)
    difference = np.abs(rotation_from_angles(omega, phi, kappa) - transposed.T).max()
    if difference <= _MAX_MATRIX_DIFFERENCE:
        return omega, phi, kappa
    as_degrees = np.abs(rotation_from_angles(*angles_rad) - transposed.T).max()
    if as_degrees <= _MAX_MATRIX_DIFFERENCE:
        raise RigError("ori", "has its angles in degrees, as its matrix shows; OpenPTV has radians")
    raise RigError(
        "ori",
        f"has angles that contradict its rotation matrix by up to {difference:.2g} in an entry; correct one of them:"
        " omega phi kappa in radians, and the transposed matrix",
    )


def _within_a_turn(degrees: float) -> float:
    """Return an angle without whole turns when it is beyond 360 degrees."""
    return degrees if abs(degrees) <= 360 else math.remainder(degrees, 360)


def _fitted(start: Camera, ideal: Float, measured: Float, corner: float) -> tuple[Camera, float]:
    """Return the camera whose distortion maps measured (n, 2) to ideal plate points (n, 2), and its maximum error."""
    powers = np.array([1, 1, corner**-2, corner**-4, corner**-1, corner**-1])
    px = np.array(start.pixel_size_mm)

    def camera(v: Float) -> Camera:
        dx, dy, K1, K2, P1, P2 = (float(c) for c in v * powers)
        x0, y0 = start.principal_point_mm
        return Camera(
            start.position_mm,
            start.rotation_deg,
            start.focal_length_mm,
            (x0 + dx, y0 + dy),
            (K1, K2),
            (P1, P2),
            start.image_size_px,
            start.pixel_size_mm,
        )

    def residuals(v: Float) -> Float:
        return np.asarray(((camera(v).undistort(measured) - ideal) / px).ravel())

    v = np.asarray(least_squares(residuals, np.zeros(6), x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14).x)
    return camera(v), float(np.linalg.norm(residuals(v).reshape(-1, 2), axis=1).max())


def _distort(ideal: Float, added: Float) -> Float:
    """Return measured plate points (n, 2) of ideal ones (n, 2) by OpenPTV's Brown model with scale and shear."""
    k1, k2, k3, p1, p2, scale, shear = added
    x, y = ideal.T
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    u = x * radial + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y
    v = y * radial + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y
    return np.stack([scale * u - np.sin(shear) * v, np.cos(shear) * v], axis=1)


def _numbers(text: str, count: int, what: str) -> list[float]:
    try:
        values = [parse_number(word) for word in text.split()]
    except NumberTextError as error:
        raise RigError(what, f"has an entry that {error}") from error
    if len(values) != count:
        raise RigError(what, f"has {len(values)} numbers; an {what} file has {count}")
    return values
