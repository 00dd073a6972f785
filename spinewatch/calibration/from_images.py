"""Shoot and calibrate: from stereo pairs of a control field to a calibrated rig and its accuracy, without clicking."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from dataclasses import field as default

import numpy as np

from spinewatch.arrays import Float, Pixels
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import CalibrationError, ControlFieldError, PlanarFieldError
from spinewatch.calibration.marks.detection import TargetParameters, Targets, find_targets
from spinewatch.calibration.marks.eccentricity import eccentricity_px
from spinewatch.calibration.marks.identification import MarkIdentificationParameters, identify
from spinewatch.calibration.points import ImagePoints, Sensor, Shot, flatness
from spinewatch.calibration.quality.accuracy import (
    ShotAccuracy,
    calibration_accuracy,
    common_points,
    leave_one_out,
    reconstruct,
)
from spinewatch.calibration.quality.stereo_geometry import StereoGeometry, stereo_geometry
from spinewatch.calibration.solve.dlt import MIN_FLATNESS
from spinewatch.calibration.solve.resection import SolveParameters
from spinewatch.calibration.stereo import Calibration, calibrate, readjust, sampled_rigs
from spinewatch.camera import Camera
from spinewatch.errors import ImageSizeError, SameImageError
from spinewatch.geometry.transforms import RigidTransform, fit_rigid
from spinewatch.progress import Progress, silent

_SAMPLES = 50
_MOST_POINTS = 500


@dataclass(frozen=True)
class FromImagesParameters:
    """Parameters of all steps.

    ``pixel_size_mm`` (px, py) of both cameras; without it the cart's sensor is assumed: 5.68 mm wide, aspect
    0.845. ``f_number`` for the depth of field.
    """

    pixel_size_mm: tuple[float, float] | None = None
    f_number: float = 4.0
    targets: TargetParameters = default(default_factory=TargetParameters)
    identify: MarkIdentificationParameters = default(default_factory=MarkIdentificationParameters)
    solve: SolveParameters = default(default_factory=SolveParameters)


@dataclass(frozen=True, eq=False)
class CalibrationResult:
    """A calibration with everything that is known of its quality.

    ``accuracy`` of each shot used and then of each not used; ``left_out`` of points left out one by one, None
    without redundancy; ``others`` the shots that took no part.
    """

    calibration: Calibration
    field: ControlField
    geometry: StereoGeometry
    accuracy: tuple[ShotAccuracy, ...]
    left_out: ShotAccuracy | None
    others: tuple[Shot, ...]


def calibrate_from_images(
    shots: Sequence[tuple[Pixels, Pixels]],
    field: ControlField,
    parameters: FromImagesParameters | None = None,
    progress: Progress = silent,
    *,
    names: Sequence[str] | None = None,
    verify: int = 0,
    rig_name: str = "rig",
) -> CalibrationResult:
    """Return the rig that took these stereo pairs (left, right) of a control field.

    The first shot defines object space; the last ``verify`` shots take no part and only show the accuracy.
    ``progress`` is called at the start of each step with its name and the fraction done.

    Raises a ``CalibrationError`` of the kind in ``calibration.errors`` whose message names shot and side,
    ``ImageSizeError`` for pictures of different sizes, ``SameImageError`` when left and right are the same.
    """
    parameters = parameters or FromImagesParameters()
    names = list(names or [str(i + 1) for i in range(len(shots))])
    _refuse_images(shots, names)
    if len(field) > _MOST_POINTS:
        raise ControlFieldError(
            f"control field {field.name!r} has {len(field)} points; of pictures at most {_MOST_POINTS} are named: leave"
            " out those that were not photographed"
        )
    if len(shots) - verify < 2 and flatness(field.points_mm) < MIN_FLATNESS:
        raise PlanarFieldError(
            f"the points of control field {field.name!r} lie in one plane: one shot of it cannot tell focal length"
            " from range; use pegs of different heights, or give several shots, tilted differently"
        )
    sensors = _sensors(shots, parameters)
    seen: list[tuple[Shot, Float, Float]] = []
    lenses: list[Camera | None] = [None, None]
    for k, (name, pair) in enumerate(zip(names, shots, strict=True)):
        progress(f"find targets of shot {k + 1} of {len(shots)}", 0.8 * k / len(shots))
        seen.append(_see(name, pair, field, sensors, lenses, parameters))
    progress("adjust", 0.8)
    first = len(seen) - verify
    calibration = calibrate([shot for shot, _, _ in seen[:first]], sensors, parameters.solve, rig_name)
    used = [
        _centred(shot, spreads, calibration, placement)
        for (shot, *spreads), placement in zip(seen[:first], calibration.placements, strict=True)
    ]
    calibration = readjust(calibration, used, parameters.solve)
    progress("assess", 0.9)
    others = [_centred(shot, spreads, calibration, None) for shot, *spreads in seen[first:]]
    result = assess(calibration, field, others, parameters.f_number)
    progress("done", 1.0)
    return result


def calibrate_from_points(
    shots: Sequence[Shot],
    field: ControlField,
    sensors: tuple[Sensor, Sensor],
    solve: SolveParameters | None = None,
    *,
    verify: int = 0,
    f_number: float = 4.0,
    rig_name: str = "rig",
) -> CalibrationResult:
    """Return the rig of ready-made coordinates; otherwise as ``calibrate_from_images``."""
    first = len(shots) - verify
    return assess(calibrate(shots[:first], sensors, solve, rig_name), field, shots[first:], f_number)


def assess(
    calibration: Calibration, field: ControlField, others: Sequence[Shot], f_number: float
) -> CalibrationResult:
    """Return a calibration with its geometry and accuracy."""
    determined = np.all(np.isfinite(calibration.adjustment.covariance))
    samples = sampled_rigs(calibration, _SAMPLES, np.random.default_rng(0)) if determined else None
    shot = calibration.shots[0]
    control = np.concatenate([shot.left.control_mm, shot.right.control_mm])
    return CalibrationResult(
        calibration,
        field,
        stereo_geometry(calibration.rig, control, samples, f_number),
        calibration_accuracy(calibration, others),
        leave_one_out(calibration),
        tuple(others),
    )


def _refuse_images(shots: Sequence[tuple[Pixels, Pixels]], names: Sequence[str]) -> None:
    for name, (left, right) in zip(names, shots, strict=True):
        if left.shape == right.shape and np.array_equal(left, right):
            raise SameImageError(
                f"shot {name}: left and right are the same picture; give the pair of two cameras"
            )
        for side, image, first in (("left", left, shots[0][0]), ("right", right, shots[0][1])):
            if image.shape != first.shape:
                raise ImageSizeError(
                    f"shot {name}: the {side} picture is {image.shape[1]} x {image.shape[0]} px, that of the first"
                    f" shot {first.shape[1]} x {first.shape[0]}; all shots must come from the same two cameras"
                )


def _sensors(
    shots: Sequence[tuple[Pixels, Pixels]], parameters: FromImagesParameters
) -> tuple[Sensor, Sensor]:
    def sensor(image: Pixels) -> Sensor:
        size = (image.shape[1], image.shape[0])
        if parameters.pixel_size_mm is None:
            return Sensor.of_cart(size)
        return Sensor(size, parameters.pixel_size_mm)

    if not shots:
        raise CalibrationError("no picture was given; give at least one stereo pair of the control field")
    return sensor(shots[0][0]), sensor(shots[0][1])


def _see(
    name: str,
    pair: tuple[Pixels, Pixels],
    field: ControlField,
    sensors: tuple[Sensor, Sensor],
    lenses: list[Camera | None],
    parameters: FromImagesParameters,
) -> tuple[Shot, Float, Float]:
    """Return the named points of one shot, and the spread of their marks by side; ``lenses`` learns from each."""
    images: list[ImagePoints] = []
    spreads: list[Float] = []
    for c, (side, image) in enumerate(zip(("left", "right"), pair, strict=True)):
        targets = find_targets(image, parameters.targets)
        where = f"the {side} picture of shot {name}"
        naming = replace(parameters.identify, estimate_aspect=parameters.solve.estimate_aspect)
        found = identify(targets, field, sensors[c], naming, where, lenses[c])
        lenses[c] = found.camera
        images.append(found.points)
        spreads.append(_spreads(found.points, targets))
    return Shot(name, images[0], images[1]), spreads[0], spreads[1]


def _spreads(points: ImagePoints, targets: Targets) -> Float:
    d = np.linalg.norm(points.pixels[:, None] - targets.pixels[None], axis=2)
    return np.asarray(targets.spread_px2[d.argmin(axis=1)])


def _centred(
    shot: Shot, spreads: Sequence[Float], calibration: Calibration, placement: RigidTransform | None
) -> Shot:
    """Return the shot with the eccentricity of its marks taken off; a shot not adjusted is placed by its points."""
    rig = calibration.rig
    if placement is None:
        _, control, left, right = common_points(shot)
        placement = fit_rigid(control, reconstruct(rig, left, right))

    def centred(image: ImagePoints, camera: Camera, spread: Float) -> ImagePoints:
        off = eccentricity_px(camera, placement, image.control_mm, spread)
        return replace(image, pixels=image.pixels - off)

    return Shot(
        shot.name, centred(shot.left, rig.left, spreads[0]), centred(shot.right, rig.right, spreads[1])
    )
