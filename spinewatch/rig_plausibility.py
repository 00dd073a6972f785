"""What every rig must fulfil: plausible sizes, and two cameras that see a common field in front of them.

The checks find numbers in a wrong unit, in a wrong field or of a wrong camera. They do not find small errors: a rig
that is off by a few percent or degrees passes, and only a measured stage shows it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.errors import RigError

SIDES = ("left", "right")
_GRID = 17
_TYPICAL_BASELINE_MM = 400.0
_UNITS = {"metres": 1000.0, "inches": 25.4, "centimetres": 10.0}


@dataclass(frozen=True)
class RigLimits:
    """Limits of a plausible rig.

    Attributes
    ----------
    pixel_size_mm
        Smallest and largest width and height of a pixel, mm.
    pixel_aspect
        Smallest and largest height over width of a pixel.
    focal_length_mm
        Smallest and largest focal length, mm.
    field_of_view_deg
        Smallest and largest horizontal field of view, degrees.
    max_principal_offset
        Largest distance of the principal point from the image centre, as a fraction of the image's width and height.
    scaled_principal_offset
        Largest such distance when it is the same fraction of width and height, to within `scaled_principal_spread`,
        which is the sign of a principal point of another image size.
    scaled_principal_spread
        See `scaled_principal_offset`.
    max_distortion
        Largest shift of an image point by lens distortion, as a fraction of its distance from the principal point.
    baseline_mm
        Smallest and largest baseline, mm.
    parallel_vergence_deg
        Optical axes at a smaller angle count as parallel: they need not meet in front of the cameras.
    max_vergence_deg
        Largest angle between the optical axes, degrees.
    range_baselines
        Smallest and largest range at which the optical axes meet, as a multiple of the baseline.
    min_common_field
        Smallest fraction of each image, at the range at which the optical axes meet, that the other camera sees too.
    max_fit_error_px
        Largest error over the image of a distortion model that is fitted to that of another file format, px.
    """

    pixel_size_mm: tuple[float, float] = (0.0005, 0.1)
    pixel_aspect: tuple[float, float] = (0.5, 2.0)
    focal_length_mm: tuple[float, float] = (1.0, 500.0)
    field_of_view_deg: tuple[float, float] = (5.0, 120.0)
    max_principal_offset: float = 0.25
    scaled_principal_offset: float = 0.1
    scaled_principal_spread: float = 0.05
    max_distortion: float = 0.5
    baseline_mm: tuple[float, float] = (50.0, 5000.0)
    parallel_vergence_deg: float = 2.0
    max_vergence_deg: float = 120.0
    range_baselines: tuple[float, float] = (0.3, 30.0)
    min_common_field: float = 0.25
    max_fit_error_px: float = 0.05


_LIMITS = RigLimits()


def check_plausible_rig(rig: Rig, limits: RigLimits = _LIMITS) -> None:
    """Check that a rig is plausible.

    Parameters
    ----------
    rig
        The rig; its numbers are finite.
    limits
        Limits of a plausible rig.

    Raises
    ------
    RigError
        If a number is implausible or the cameras do not see a common field; names the field and the likely cause.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig = large_rig()
    >>> check_plausible_rig(rig)
    >>> check_plausible_rig(Rig("micrometres", rig.left, replace(rig.right, pixel_size_mm=(10.0, 8.45))))
    Traceback (most recent call last):
    spinewatch.errors.RigError: rig field 'right.pixel_size_mm' is (10, 8.45) mm, outside 0.0005 to 0.1; micrometres \
for mm?
    """
    for side in SIDES:
        check_plausible_camera(getattr(rig, side), side, limits)
    _check_baseline(rig, limits)
    problem = _orientation_problem(rig, limits)
    if problem is None and is_parallel(rig, limits) and sees_common_field(with_angles(rig, math.degrees)):
        problem = (
            "rotation_deg",
            f"makes the optical axes parallel within {rig.vergence_deg:.2g} degrees; read as radians they meet in front"
            " of the cameras: radians for degrees?",
        )
    if problem is not None:
        field, text = problem
        raise RigError(f"right.{field}", text)


def check_measurable_rig(rig: Rig) -> None:
    """Check that stages can be measured with a plausible rig, for which the range of the markers is not known.

    Parameters
    ----------
    rig
        The rig.

    Raises
    ------
    RigError
        If the optical axes do not meet in front of the cameras.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> check_measurable_rig(large_rig())
    """
    meet = rig.axes_approach_mm
    if meet is None or min(meet) <= 0:
        raise RigError(
            "right.rotation_deg",
            "makes the optical axes meet nowhere in front of the cameras, so that they do not tell the range of the"
            " markers; give the range with each stage, or turn the cameras towards each other and calibrate again",
        )


def check_plausible_camera(camera: Camera, side: str, limits: RigLimits = _LIMITS) -> None:
    """Check that one camera is plausible.

    Parameters
    ----------
    camera
        The camera; its numbers are finite.
    side
        Name of the camera, the first part of the fields in errors.
    limits
        Limits of a plausible rig.

    Raises
    ------
    RigError
        If a number is implausible; names the field and the likely cause.
    """
    problem = (
        _sensor_problem(camera, limits) or lens_problem(camera, limits) or _distortion_problem(camera, limits)
    )
    if problem is not None:
        field, text = problem
        raise RigError(f"{side}.{field}", text)


def lens_problem(camera: Camera, limits: RigLimits = _LIMITS) -> tuple[str, str] | None:
    """Return what is implausible in the field of view or the principal point of a camera.

    Parameters
    ----------
    camera
        The camera; its numbers are finite and its sensor and focal length are positive.
    limits
        Limits of a plausible rig.

    Returns
    -------
    tuple of str or None
        Name of the field and what is wrong with it; None for a plausible camera.
    """
    width, height = camera.image_size_px
    view = math.degrees(2 * math.atan(width * camera.pixel_size_mm[0] / 2 / camera.focal_length_mm))
    low, high = limits.field_of_view_deg
    if not low <= view <= high:
        cause = "pixels for mm?" if view < low else "another unit, or the focal length of another image size?"
        return (
            "focal_length_mm",
            f"gives a field of view of {view:.3g} degrees, outside {low:g} to {high:g}; {cause}",
        )
    u, v = camera.pixels(camera.principal_point_mm)
    x, y = (u - (width - 1) / 2) / width, (v - (height - 1) / 2) / height
    far = max(abs(x), abs(y)) > limits.max_principal_offset
    scaled = min(abs(x), abs(y)) > limits.scaled_principal_offset
    scaled = scaled and abs(x - y) < limits.scaled_principal_spread
    if not (far or scaled):
        return None
    other = (
        f", such as {2 * round(u)} x {2 * round(v)}"
        if min(u, v) > 0 and max(u / width, v / height) < 10
        else ""
    )
    return (
        "principal_point_mm",
        f"lies at ({u:.4g}, {v:.4g}) px in an image of {width} x {height}, far from its centre; is it in pixels, or of"
        f" another image size{other}?",
    )


def is_parallel(rig: Rig, limits: RigLimits = _LIMITS) -> bool:
    """Return whether the optical axes count as parallel.

    Parameters
    ----------
    rig
        The rig.
    limits
        Limits of a plausible rig.

    Returns
    -------
    bool
        Whether the vergence is below `RigLimits.parallel_vergence_deg`.
    """
    return rig.vergence_deg < limits.parallel_vergence_deg


def sees_common_field(rig: Rig, limits: RigLimits = _LIMITS) -> bool:
    """Return whether the optical axes converge to a field that both cameras see.

    Parameters
    ----------
    rig
        The rig.
    limits
        Limits of a plausible rig.

    Returns
    -------
    bool
        False also for parallel axes.
    """
    return rig.baseline_mm > 0 and not is_parallel(rig, limits) and _orientation_problem(rig, limits) is None


def with_angles(rig: Rig, reading: Callable[[float], float]) -> Rig:
    """Return a rig whose angles are read in another way.

    Parameters
    ----------
    rig
        The rig.
    reading
        Function from each angle as it was read, degrees, to the angle of the other reading, degrees.

    Returns
    -------
    Rig
        The rig with the other angles.
    """

    def again(camera: Camera) -> Camera:
        omega, phi, kappa = (reading(angle) for angle in camera.rotation_deg)
        return replace(camera, rotation_deg=(omega, phi, kappa))

    return Rig(rig.name, again(rig.left), again(rig.right))


def _sensor_problem(camera: Camera, limits: RigLimits) -> tuple[str, str] | None:
    """Return what is implausible in pixel size, focal length or angles: the field and the text."""
    low, high = limits.pixel_size_mm
    pixel = camera.pixel_size_mm
    if not low <= min(pixel) <= max(pixel) <= high:
        cause = "micrometres for mm?" if max(pixel) > high else "metres for mm?"
        return "pixel_size_mm", f"is ({pixel[0]:g}, {pixel[1]:g}) mm, outside {low:g} to {high:g}; {cause}"
    low, high = limits.pixel_aspect
    if not low <= pixel[1] / pixel[0] <= high:
        return (
            "pixel_size_mm",
            f"is ({pixel[0]:g}, {pixel[1]:g}) mm, a ratio outside {low:g} to {high:g}; give its width and height",
        )
    low, high = limits.focal_length_mm
    f = camera.focal_length_mm
    if not low <= f <= high:
        cause = "pixels or micrometres for mm?" if f > high else "metres for mm, or another parameter?"
        return "focal_length_mm", f"is {f:.4g} mm, outside {low:g} to {high:g}; {cause}"
    largest = max(map(abs, camera.rotation_deg))
    if largest > 360:
        return (
            "rotation_deg",
            f"has an angle of {largest:.8g} degrees, beyond 360; packed as DDDMMSS? Give decimal degrees",
        )
    return None


def _distortion_problem(camera: Camera, limits: RigLimits) -> tuple[str, str] | None:
    """Return what is implausible in the lens distortion: the field and the text."""
    field = "radial" if any(camera.radial) else "decentering"
    pixels = pixel_grid(camera.image_size_px)
    with np.errstate(all="ignore"):
        J = camera.undistortion_jacobian(pixels)
        px, py = camera.pixel_size_mm
        if not np.all(np.linalg.det(J) / (-px * py) > 0):
            return (
                field,
                "makes the distortion fold within the image, so that two pixels have the same ray; give K1 per mm^2, K2"
                " per mm^4, P1 and P2 per mm, valid over the whole image",
            )
        d = camera.plate(pixels) - camera.principal_point_mm
        r = np.linalg.norm(d, axis=1)
        shift = np.linalg.norm(camera.undistort(camera.plate(pixels)) - d, axis=1)
        share = float(np.max(shift[r > 0] / r[r > 0], initial=0.0))
    if not share <= limits.max_distortion:
        return (
            field,
            f"moves image points by up to {100 * share:.3g}% of their distance from the principal point, more than"
            f" {100 * limits.max_distortion:.0f}%; give K1 per mm^2, K2 per mm^4, P1 and P2 per mm",
        )
    return None


def _check_baseline(rig: Rig, limits: RigLimits) -> None:
    """Raise RigError for an implausible baseline."""
    low, high = limits.baseline_mm
    baseline = rig.baseline_mm
    if low <= baseline <= high:
        return
    if baseline < low / max(_UNITS.values()):
        hint = "two cameras need a baseline"
    elif baseline < low:
        hint = f"{min(_UNITS, key=lambda unit: abs(math.log(_UNITS[unit] * baseline / _TYPICAL_BASELINE_MM)))} for mm?"
    else:
        hint = "another unit, or positions of different object spaces?"
    raise RigError(
        "right.position_mm", f"gives a baseline of {baseline:.4g} mm, outside {low:g} to {high:g}; {hint}"
    )


def _orientation_problem(rig: Rig, limits: RigLimits) -> tuple[str, str] | None:
    """Return what is implausible in the relative orientation: the field and the text."""
    problem = _side_problem(rig)
    return problem if problem is not None or is_parallel(rig, limits) else _convergence_problem(rig, limits)


def _side_problem(rig: Rig) -> tuple[str, str] | None:
    """Return a problem if left and right are exchanged, or the cameras look away from object space."""
    cameras = (rig.left, rig.right)
    base = (rig.right.centre - rig.left.centre) / rig.baseline_mm
    if max(float(base @ camera.M[0]) for camera in cameras) < -0.5:
        return (
            "position_mm",
            "lies to the left of left.position_mm in both images; are left and right exchanged?",
        )
    origin_depth_mm = max(camera.depth_mm((0.0, 0.0, 0.0)) for camera in cameras)
    if origin_depth_mm < -rig.baseline_mm / 2 and max(camera.M[2, 2] for camera in cameras) < 0:
        return (
            "rotation_deg",
            "makes both cameras look along Z, away from the origin of object space; Z points towards the cameras, and"
            " the field of the calibration lies in front of them",
        )
    return None


def _convergence_problem(rig: Rig, limits: RigLimits) -> tuple[str, str] | None:
    """Return a problem if the optical axes do not converge to a field that both cameras see."""
    depths = rig.axes_approach_mm
    if depths is None or min(depths) <= 0:
        return (
            "rotation_deg",
            f"makes the cameras look away from each other: their optical axes, {rig.vergence_deg:.1f} degrees apart, do"
            " not meet in front of both; check signs, units and the order of the angles",
        )
    if rig.vergence_deg > limits.max_vergence_deg:
        return (
            "rotation_deg",
            f"gives a vergence of {rig.vergence_deg:.1f} degrees, more than {limits.max_vergence_deg:g}: the cameras"
            " see opposite sides of the field; check signs and units of the angles",
        )
    low, high = (limit * rig.baseline_mm for limit in limits.range_baselines)
    if not low <= min(depths) <= max(depths) <= high:
        return (
            "rotation_deg",
            f"makes the optical axes meet at a range of {depths[0]:.4g} and {depths[1]:.4g} mm, outside {low:.4g} to"
            f" {high:.4g} for this baseline; check units of angles and positions",
        )
    share = min(_share_seen(rig.left, depths[0], rig.right), _share_seen(rig.right, depths[1], rig.left))
    if share < limits.min_common_field:
        return (
            "rotation_deg",
            f"leaves only {100 * share:.0f}% of an image that the other camera sees too, at the range at which the"
            " optical axes are nearest; check rotation and position",
        )
    return None


def _share_seen(camera: Camera, depth_mm: float, other: Camera) -> float:
    """Return the fraction of an image, in a plane at a depth along the axis, that another camera sees."""
    d = camera.directions(pixel_grid(camera.image_size_px))
    points = camera.centre + d * (depth_mm / (d @ -camera.M[2]))[:, None]
    with np.errstate(all="ignore"):
        uv = other.project(points)
    inside = np.all((uv >= -0.5) & (uv <= np.array(other.image_size_px) - 0.5), axis=1)
    return float(inside.mean())


def pixel_grid(image_size_px: tuple[int, int], count: int = _GRID) -> Float:
    """Return pixels on a regular grid over an image, with its corners.

    Parameters
    ----------
    image_size_px
        (W, H), px.
    count
        Number of pixels per axis.

    Returns
    -------
    Float
        (u, v), shape (count^2, 2), row by row, px.
    """
    width, height = image_size_px
    u, v = np.meshgrid(np.linspace(0, width - 1, count), np.linspace(0, height - 1, count))
    return np.stack([u.ravel(), v.ravel()], axis=1)
