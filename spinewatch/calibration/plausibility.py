"""What a calibration must be: image points within an image, sizes of a stereo rig in mm, residuals of a sound fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ImplausibleCalibrationError, PixelSizeError, PointsError
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import shot_accuracy
from spinewatch.calibration.solve.bundle import BundleAdjustment, adjust, rms
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES
from spinewatch.camera import Camera, Rig
from spinewatch.errors import SpinewatchError
from spinewatch.flags import Flag

_MM_PER_UNIT = {"metres": 1000.0, "inches": 25.4, "centimetres": 10.0}
_POSITION = ("X0", "Y0", "Z0")


@dataclass(frozen=True)
class PlausibilityParameters:
    """Limits of a plausible calibration.

    Attributes
    ----------
    pixel_mm
        Least and greatest width and height of a pixel, mm.
    focal_length_mm
        Least and greatest focal length, mm.
    range_mm
        Least and greatest depth of the control field, mm.
    baseline_mm
        Least and greatest distance of two cameras, mm.
    usual_range_mm
        Depths at which control fields are photographed: a unit that leads to one is named in the error, mm.
    min_extent_px
        Extent of the points of an image below which they are not pixels, px.
    border_px
        Distance of a point outside the image that is permitted, px.
    principal_point
        Greatest offset of the principal point from the image centre, as a fraction of the width and height; beyond
        it the calibration is flagged, ...
    same_shape
        ... and refused if the fractions differ by less than this: it is the centre of an image of another size.
    aspect
        Deviation of the aspect of the pixels from the assumed one that is flagged, as a fraction of it, ...
    sigmas
        ... if it also exceeds this number of standard deviations. Also for the principal point.
    max_aspect_sd
        Standard deviation of the aspect up to which it counts as measured, as a fraction of it.
    rms_px
        Image RMS above which a calibration is flagged, px, and several shots are refused ...
    rms_of_single
        ... if it is also this many times the RMS of each camera alone.
    baseline_sd
        Standard deviation of the baseline above which a rig is refused, as a fraction of it.
    residual_of_field
        RMS of the reconstructed control points above which a rig is refused, as a fraction of the field's diagonal.
    doubtful
        Fraction of the last two limits above which the calibration is flagged.
    repeated_px
        RMS difference of all image points up to which two shots count as one, px.
    max_alternatives
        Number of other orders and pairings of the images that are tried when shots disagree.
    """

    pixel_mm: tuple[float, float] = (0.0005, 0.1)
    focal_length_mm: tuple[float, float] = (1.0, 500.0)
    range_mm: tuple[float, float] = (100.0, 20000.0)
    baseline_mm: tuple[float, float] = (50.0, 5000.0)
    usual_range_mm: tuple[float, float] = (300.0, 3000.0)
    min_extent_px: float = 2.0
    border_px: float = 1.0
    principal_point: float = 0.15
    same_shape: float = 0.1
    aspect: float = 0.01
    sigmas: float = 4.0
    max_aspect_sd: float = 0.01
    rms_px: float = 0.5
    rms_of_single: float = 5.0
    baseline_sd: float = 0.05
    residual_of_field: float = 0.01
    doubtful: float = 0.2
    repeated_px: float = 0.15
    max_alternatives: int = 20


def check_sensor(sensor: Sensor, parameters: PlausibilityParameters) -> None:
    """Check that the pixels of a sensor have a size that pixels can have.

    Parameters
    ----------
    sensor
        The sensor.
    parameters
        Limits.

    Raises
    ------
    PixelSizeError
        If they do not; the message gives the unit.
    """
    low, high = parameters.pixel_mm
    width, height = sensor.pixel_size_mm
    if not (low <= width <= high and low <= height <= high):
        unit = next(
            (
                f": in {name}?"
                for name, factor in (("micrometres", 0.001), ("metres", 1000.0))
                if low <= factor * width <= high
            ),
            "",
        )
        raise PixelSizeError(
            f"the pixel size is {width:g} x {height:g} mm{unit}; give it in mm, between {low:g} and {high:g}"
        )


def check_image_points(
    images: Iterable[tuple[str, ImagePoints]], sensor: Sensor, parameters: PlausibilityParameters
) -> None:
    """Check that the image points of one camera are pixels of its image.

    Parameters
    ----------
    images
        Name and image points of each image of the camera.
    sensor
        The sensor.
    parameters
        Limits.

    Raises
    ------
    PointsError
        If the points lie within one or two pixels, or one lies outside the image.
    """
    w, h = sensor.image_size_px
    for where, image in images:
        if len(image) > 1 and np.ptp(image.pixels, axis=0).max() < parameters.min_extent_px:
            u, v = np.ptp(image.pixels, axis=0)
            raise PointsError(
                f"{where}: all points lie within {u:.2g} x {v:.2g} px, hardly more than one pixel: normalized"
                " coordinates? Give u_px and v_px in pixels"
            )
        border = 0.5 + parameters.border_px
        outside = np.any((image.pixels < -border) | (image.pixels > np.array([w, h]) - 1 + border), axis=1)
        if outside.any():
            i = int(np.argmax(outside))
            swapped = image.pixels[:, ::-1]
            fits = np.all((swapped >= -border) & (swapped <= np.array([w, h]) - 1 + border))
            cause = ", or exchange u_px and v_px" if fits else ""
            u, v = image.pixels[i]
            raise PointsError(
                f"{where}: point {image.ids[i]} at ({u:.1f}, {v:.1f}) px lies outside the image of {w} x {h} px"
                f" ({outside.sum()} of {len(image)} points do); give the size of the image that was measured{cause}"
            )


def check_cameras(
    names: Sequence[str],
    adjustment: BundleAdjustment,
    parameters: PlausibilityParameters,
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


def _check_unit(adjustment: BundleAdjustment, parameters: PlausibilityParameters, *, is_rig: bool) -> None:
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
    name: str, camera: Camera, sd: Mapping[str, float], parameters: PlausibilityParameters
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
    camera: Camera, sd: Mapping[str, float], parameters: PlausibilityParameters
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
    adjustment: BundleAdjustment, camera_names: Sequence[str], parameters: PlausibilityParameters
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
    adjustment: BundleAdjustment, camera_names: Sequence[str], parameters: PlausibilityParameters
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


@dataclass(frozen=True)
class FitDoubts:
    """Reasons against a fit.

    Attributes
    ----------
    refused
        Reasons for which it is no calibration.
    flagged
        Reasons for which it is a poor one.
    """

    refused: tuple[str, ...]
    flagged: tuple[str, ...]


@dataclass(frozen=True)
class FitLimits:
    """Limits that a fit is compared with.

    Attributes
    ----------
    rms_px
        Image RMS above which it is flagged, px.
    baseline_sd_mm
        Standard deviation of the baseline above which it is flagged, and refused, mm.
    reconstruction_mm
        RMS of the reconstructed control points per coordinate above which it is flagged, and refused, mm.
    """

    rms_px: float
    baseline_sd_mm: tuple[float, float]
    reconstruction_mm: tuple[float, float]


def fit_limits(rig: Rig, shots: Sequence[Shot], parameters: PlausibilityParameters) -> FitLimits:
    """Return the limits of the fit of a rig to its shots.

    Parameters
    ----------
    rig
        The rig.
    shots
        Its shots without blunders.
    parameters
        Limits as fractions of baseline and field.

    Returns
    -------
    FitLimits
        Limits, px and mm.
    """
    baseline = parameters.baseline_sd * rig.baseline_mm
    residual = parameters.residual_of_field * _diagonal_mm(shots)
    doubt = parameters.doubtful
    return FitLimits(parameters.rms_px, (doubt * baseline, baseline), (doubt * residual, residual))


def fit_doubts(
    rig: Rig, shots: Sequence[Shot], adjustment: BundleAdjustment, parameters: PlausibilityParameters
) -> FitDoubts:
    """Return what contradicts an adjusted rig: image residuals, deviation of the baseline, residuals on the board.

    Parameters
    ----------
    rig
        The rig.
    shots
        Its shots without blunders.
    adjustment
        Adjustment of both cameras, left first.
    parameters
        Limits.

    Returns
    -------
    FitDoubts
        Reasons with their numbers. Without redundancy there are none: nothing can be compared.
    """
    if adjustment.block.dof <= 0:
        return FitDoubts((), ())
    if not adjustment.is_determined:
        return FitDoubts(("the points leave the cameras undetermined",), ())
    refused: list[str] = []
    flagged: list[str] = []
    limits = fit_limits(rig, shots, parameters)
    rms_px = adjustment.rms_px
    if rms_px > limits.rms_px:
        alone = _single_camera_rms_px(adjustment)
        text = f"image RMS {rms_px:.2f} px, each camera alone {alone:.2f} px"
        (refused if rms_px > parameters.rms_of_single * alone else flagged).append(text)
    sd, (doubtful, impossible) = baseline_sd_mm(adjustment), limits.baseline_sd_mm
    if not sd <= doubtful:
        text = f"baseline {rig.baseline_mm:.4g} +- {sd:.2g} mm"
        (flagged if sd <= impossible else refused).append(text)
    residual, (doubtful, impossible) = _residual_mm(rig, shots, adjustment), limits.reconstruction_mm
    if residual > doubtful:
        text = (
            f"control points reconstructed with an RMS error of {residual:.2g} mm in a field of"
            f" {_diagonal_mm(shots):.0f} mm"
        )
        (flagged if residual <= impossible else refused).append(text)
    return FitDoubts(tuple(refused), tuple(flagged))


def baseline_sd_mm(adjustment: BundleAdjustment) -> float:
    """Return the standard deviation of the distance of two cameras, propagated from their covariance.

    Parameters
    ----------
    adjustment
        Adjustment of both cameras.

    Returns
    -------
    float
        Standard deviation, mm.
    """
    left, right = adjustment.block.cameras
    direction = (right.centre - left.centre) / np.linalg.norm(right.centre - left.centre)
    gradient = np.zeros(len(adjustment.names))
    for c, sign in ((0, -1.0), (1, 1.0)):
        for name, component in zip(_POSITION, direction, strict=True):
            if f"{c}:{name}" in adjustment.names:
                gradient[adjustment.names.index(f"{c}:{name}")] = sign * component
    return float(np.sqrt(gradient @ adjustment.covariance @ gradient))


def _single_camera_rms_px(adjustment: BundleAdjustment) -> float:
    """Return the greater RMS of the two cameras, each adjusted with its own placements of the board."""
    block = adjustment.block
    values = []
    for c in range(len(block.cameras)):
        shots = sorted(s for camera, s in block.images if camera == c)
        alone = replace(
            block,
            cameras=(block.cameras[c],),
            placements=tuple(block.placements[s] for s in shots),
            images={(0, i): block.images[c, s] for i, s in enumerate(shots)},
            free=(block.free[c],),
        )
        values.append(adjust(alone).rms_px)
    return max(values)


def _residual_mm(rig: Rig, shots: Sequence[Shot], adjustment: BundleAdjustment) -> float:
    """Return the RMS of the reconstructed control points of the shots, per coordinate."""
    images = adjustment.block.images
    residuals = [
        shot_accuracy(rig, shot, used=True, defines_object_space=s == 0).residuals_mm
        for s, shot in enumerate(shots)
        if (0, s) in images and (1, s) in images
    ]
    values = np.concatenate([r.ravel() for r in residuals]) if residuals else np.zeros(1)
    return rms(values[np.isfinite(values)])


def _diagonal_mm(shots: Sequence[Shot]) -> float:
    points: Float = np.concatenate([image.control_mm for shot in shots for image in shot.images])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def repeated_shots(shots: Sequence[Shot], parameters: PlausibilityParameters) -> dict[int, tuple[int, float]]:
    """Return the shots that show the board where an earlier shot shows it.

    Parameters
    ----------
    shots
        The shots.
    parameters
        Limits.

    Returns
    -------
    dict of int to tuple
        Index of the earlier shot, and the RMS difference of the image points, px, by index of the repeated shot.
    """
    repeated: dict[int, tuple[int, float]] = {}
    for later, shot in enumerate(shots):
        for earlier in range(later):
            difference = _difference_px(shots[earlier], shot)
            if earlier not in repeated and difference <= parameters.repeated_px:
                repeated[later] = (earlier, difference)
                break
    return repeated


def _difference_px(a: Shot, b: Shot) -> float:
    """Return the RMS difference of the common image points of both sides; infinite if a side has too few."""
    differences = []
    for one, other in zip(a.images, b.images, strict=True):
        pixels = dict(zip(other.ids, other.pixels, strict=True))
        common = [uv - pixels[id_] for id_, uv in zip(one.ids, one.pixels, strict=True) if id_ in pixels]
        if 2 * len(common) <= min(len(one), len(other)):
            return float("inf")
        differences.append(np.array(common))
    return rms(np.concatenate(differences))
