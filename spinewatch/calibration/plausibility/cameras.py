"""What calibrated cameras must be: of sizes in mm, with a central principal point and pixels of the assumed shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from spinewatch.calibration.errors import ImplausibleCalibrationError
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES
from spinewatch.camera import Camera
from spinewatch.errors import SpinewatchError
from spinewatch.flags import Flag

_MM_PER_UNIT = {"metres": 1000.0, "inches": 25.4, "centimetres": 10.0}


def check_cameras(
    names: Sequence[str],
    adjustment: BundleAdjustment,
    parameters: CalibrationLimits,
    *,
    is_rig: bool,
) -> None:
    """Check range, focal length and principal point of adjusted cameras, and the baseline of a rig.

    Parameters
    ----------
    names
        Names of the cameras.
    adjustment
        Their adjustment.
    parameters
        Limits.
    is_rig
        Whether the cameras are those of a stereo rig.

    Raises
    ------
    ImplausibleCalibrationError
        If one of them is outside its limits; the message gives the number and the likeliest cause.
    """
    cameras = adjustment.block.cameras
    _check_unit(adjustment, parameters, is_rig=is_rig)
    for c, (name, camera) in enumerate(zip(names, cameras, strict=True)):
        f, (low, high) = camera.focal_length_mm, parameters.focal_length_mm
        if not low <= f <= high:
            raise ImplausibleCalibrationError(
                f"{name}: the focal length is {f:.3g} mm, outside {low:g} to {high:g} mm; check the pixel size (mm) and"
                " the image points (px)"
            )
        _check_principal_point(name, camera, adjustment.camera_sd(c), parameters)


def _check_unit(adjustment: BundleAdjustment, parameters: CalibrationLimits, *, is_rig: bool) -> None:
    """Check the distances of the cameras from the field and from each other, which show the unit of the field."""
    cameras = adjustment.block.cameras
    images = [image for (_, s), image in adjustment.block.images.items() if s == 0]
    centre = np.concatenate([image.control_mm for image in images]).mean(axis=0)
    depth = float(np.median([camera.depth_mm(centre) for camera in cameras]))
    baselines = [float(np.linalg.norm(a.centre - b.centre)) for a, b in pairwise(cameras)] if is_rig else []
    for what, value, (low, high) in (
        ("the range of the control field", depth, parameters.range_mm),
        *(("the baseline", baseline, parameters.baseline_mm) for baseline in baselines),
    ):
        if not low <= value <= high:
            near, far = parameters.usual_range_mm
            units = [name for name, factor in _MM_PER_UNIT.items() if near <= factor * depth <= far]
            cause = f": control points in {' or '.join(units)}?" if units else ""
            raise ImplausibleCalibrationError(
                f"{what} is {value:.3g} mm, outside {low:g} to {high:g} mm{cause}; give x_mm, y_mm and z_mm in"
                " millimetres, and check the pixel size"
            )


def _check_principal_point(
    name: str, camera: Camera, sd: Mapping[str, float], parameters: CalibrationLimits
) -> None:
    """Refuse a principal point that is the centre of an image of the same shape and another size."""
    offset = _principal_point_offset(camera, sd, parameters)
    if offset is not None and abs(offset[0] - offset[1]) < parameters.same_shape:
        (u, v), (w, h) = camera.pixels(camera.principal_point_mm), camera.image_size_px
        raise ImplausibleCalibrationError(
            f"{name}: the principal point is at ({u:.0f}, {v:.0f}) px, the centre of an image of about {2 * u:.0f} x"
            f" {2 * v:.0f} px and not of {w} x {h} px; give the image size in which the points were measured"
        )


def _principal_point_offset(
    camera: Camera, sd: Mapping[str, float], parameters: CalibrationLimits
) -> tuple[float, float] | None:
    """Return the significant offset (u, v) of the principal point from the image centre, of width and height."""
    width, height = np.array(camera.image_size_px) * camera.pixel_size_mm
    x0, y0 = camera.principal_point_mm
    limits = {"x0": parameters.principal_point * width, "y0": parameters.principal_point * height}
    for name, value in (("x0", x0), ("y0", y0)):
        if abs(value) > max(limits[name], parameters.sigmas * sd.get(name, np.inf)):
            return float(x0 / width), float(-y0 / height)
    return None


def principal_point_doubts(
    adjustment: BundleAdjustment, camera_names: Sequence[str], parameters: CalibrationLimits
) -> tuple[Flag, ...]:
    """Return a flag for each camera whose principal point is far from the centre of its image.

    Parameters
    ----------
    adjustment
        Adjustment of the cameras.
    camera_names
        Their names.
    parameters
        Limits.

    Returns
    -------
    tuple of Flag
        ``calibration-poor``.
    """
    flags = []
    for c, (name, camera) in enumerate(zip(camera_names, adjustment.block.cameras, strict=True)):
        if _principal_point_offset(camera, adjustment.camera_sd(c), parameters) is not None:
            (u, v), (w, h) = camera.pixels(camera.principal_point_mm), camera.image_size_px
            flags.append(
                Flag(
                    "calibration-poor",
                    f"{name}: the principal point is at ({u:.0f}, {v:.0f}) px of an image of {w} x {h} px, far from its"
                    " centre: a cropped image, another image size, or a wall of glass in front of the field?",
                )
            )
    return tuple(flags)


def aspect_doubts(
    adjustment: BundleAdjustment, camera_names: Sequence[str], parameters: CalibrationLimits
) -> tuple[Flag, ...]:
    """Return a flag for each camera whose points show another aspect of the pixels than the assumed one.

    Parameters
    ----------
    adjustment
        Adjustment with the aspect held; one in which it is adjusted raises no flag.
    camera_names
        Names of its cameras.
    parameters
        Limits.

    Returns
    -------
    tuple of Flag
        ``pixel-size-doubtful``.
    """
    block = adjustment.block
    if any("aspect" in free for free in block.free) or not adjustment.is_determined:
        return ()
    free = tuple(tuple(n for n in PARAMETER_NAMES if n in names or n == "aspect") for names in block.free)
    try:
        other = adjust(replace(block, free=free))
    except SpinewatchError:
        return ()
    if not (other.is_determined and other.block.dof > 0):
        return ()
    flags = []
    for c, name in enumerate(camera_names):
        assumed, found = _aspect(block.cameras[c]), _aspect(other.block.cameras[c])
        sd = other.camera_sd(c)["aspect"]
        difference = abs(found - assumed)
        if sd < parameters.max_aspect_sd * assumed and difference > max(
            parameters.aspect * assumed, parameters.sigmas * sd
        ):
            flags.append(
                Flag(
                    "pixel-size-doubtful",
                    f"{name}: the points show an aspect of {found:.4f} +- {sd:.4f} (height over width of a pixel),"
                    f" {assumed:.4f} was assumed; give the pixel size",
                )
            )
    return tuple(flags)


def _aspect(camera: Camera) -> float:
    return camera.pixel_size_mm[1] / camera.pixel_size_mm[0]
