"""From stereo pairs of a control field to a calibrated rig and its accuracy, without manual measurement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from dataclasses import field as default

import numpy as np

from spinewatch.arrays import Float, Pixels
from spinewatch.calibration.boards import BoardField
from spinewatch.calibration.checked import calibrate_checked, doubt_flags
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import CalibrationError, ControlFieldError, PlanarFieldError
from spinewatch.calibration.marks.assignment import MarkIdentificationParameters
from spinewatch.calibration.marks.board_corners import BoardCornerParameters, find_corners, upright_shots
from spinewatch.calibration.marks.detection import TargetParameters, Targets, find_targets
from spinewatch.calibration.marks.eccentricity import eccentricity_px
from spinewatch.calibration.marks.identification import identify_targets
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.plausibility.points import check_sensor, repeated_shots
from spinewatch.calibration.points import ImagePoints, Sensor, Shot, flatness
from spinewatch.calibration.quality.accuracy import (
    ShotAccuracy,
    calibration_accuracy,
    common_points,
    reconstruct,
)
from spinewatch.calibration.quality.leave_one_out import leave_one_out
from spinewatch.calibration.quality.rig_samples import sample_rigs
from spinewatch.calibration.quality.stereo_geometry import StereoGeometry, stereo_geometry
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import StereoCalibration, readjust
from spinewatch.camera import Camera
from spinewatch.errors import ImageSizeError, SameImageError
from spinewatch.flags import Flag
from spinewatch.geometry.transforms import RigidTransform, fit_rigid
from spinewatch.imaging.frame import SIDES
from spinewatch.progress import Progress, part, silent


@dataclass(frozen=True)
class CalibrationParameters:
    """Parameters of all steps.

    Attributes
    ----------
    pixel_size_mm
        (px, py) of both cameras, mm; by default the cart's sensor, 5.68 mm wide, aspect 0.845.
    f_number
        F-number of the depth of field.
    n_rig_samples
        Rigs drawn from the covariance for the standard deviations of baseline and vergence.
    max_field_points
        Largest control field that is identified in images.
    targets
        Detection of the targets.
    corners
        Detection of the corners of chessboards and ChArUco boards.
    identification
        Identification of the targets.
    solve
        Solution of the cameras.
    plausibility
        Limits of a plausible calibration.
    """

    pixel_size_mm: tuple[float, float] | None = None
    f_number: float = 4.0
    n_rig_samples: int = 50
    max_field_points: int = 500
    targets: TargetParameters = default(default_factory=TargetParameters)
    corners: BoardCornerParameters = default(default_factory=BoardCornerParameters)
    identification: MarkIdentificationParameters = default(default_factory=MarkIdentificationParameters)
    solve: SolveParameters = default(default_factory=SolveParameters)
    plausibility: CalibrationLimits = default(default_factory=CalibrationLimits)


@dataclass(frozen=True, eq=False)
class CalibrationResult:
    """A calibration and its quality.

    Attributes
    ----------
    calibration
        The calibrated rig.
    field
        The control field.
    geometry
        Geometry of the rig.
    accuracy
        Accuracy of each adjusted shot, then of each shot held out.
    leave_one_out
        Accuracy of points left out one at a time; None without redundancy.
    held_out
        Shots that took no part in the adjustment.
    """

    calibration: StereoCalibration
    field: ControlField
    geometry: StereoGeometry
    accuracy: tuple[ShotAccuracy, ...]
    leave_one_out: ShotAccuracy | None
    held_out: tuple[Shot, ...]


@dataclass(frozen=True, eq=False)
class _MeasuredShot:
    """Identified targets of a shot, and the mean variance (n,) of each mark, by side; None of corners."""

    shot: Shot
    variances_px2: tuple[Float, Float] | None


def calibrate_from_images(
    shots: Sequence[tuple[Pixels, Pixels]],
    field: ControlField,
    parameters: CalibrationParameters | None = None,
    progress: Progress = silent,
    *,
    names: Sequence[str] | None = None,
    verify: int = 0,
    rig_name: str = "rig",
) -> CalibrationResult:
    """Return the rig that took stereo pairs of a control field.

    Parameters
    ----------
    shots
        Left and right image of each shot, shape (H, W), gray; the first defines object space.
    field
        The control field.
    parameters
        Parameters of all steps.
    progress
        Called at the start of each step.
    names
        Names of the shots; by default "1", "2" and so on.
    verify
        Number of trailing shots held out for verification.
    rig_name
        Name of the rig.

    Returns
    -------
    CalibrationResult
        The rig and its quality.

    Raises
    ------
    CalibrationError
        If no calibration can be made; the message names shot and side.
    ImageSizeError
        If images of one camera have different sizes.
    SameImageError
        If left and right of a shot are the same image.
    """
    parameters = parameters or CalibrationParameters()
    names = list(names or [str(i + 1) for i in range(len(shots))])
    _check_images(shots, names)
    _check_field(field, len(shots) - verify, parameters)
    sensors = _sensors(shots[0], parameters)
    measured: list[_MeasuredShot] = []
    lenses: tuple[Camera | None, Camera | None] = (None, None)
    for k, (name, pair) in enumerate(zip(names, shots, strict=True)):
        progress(f"find targets of shot {k + 1} of {len(shots)}", 0.8 * k / len(shots))
        if isinstance(field, BoardField):
            measured.append(_MeasuredShot(find_corners(pair, name, field, parameters.corners), None))
            continue
        shot, lenses = _measure(name, pair, field, sensors, lenses, parameters)
        measured.append(shot)
    if isinstance(field, BoardField):
        field, upright = upright_shots([m.shot for m in measured], field)
        measured = [_MeasuredShot(shot, None) for shot in upright]
    progress("adjust", 0.8)
    kept, repeated = _without_repeated([m.shot for m in measured], parameters)
    adjusted = [measured[k] for k in kept if k < len(measured) - verify]
    held_out = [measured[k] for k in kept if k >= len(measured) - verify]
    calibration = calibrate_checked(
        [m.shot for m in adjusted],
        sensors,
        parameters.solve,
        parameters.plausibility,
        rig_name,
        part(progress, 0.8, 0.9),
    )
    corrected = [
        _without_eccentricity(m, calibration, placement)
        for m, placement in zip(adjusted, calibration.placements, strict=True)
    ]
    if not isinstance(field, BoardField):
        calibration = readjust(calibration, corrected, parameters.solve)
    progress("assess", 0.9)
    fresh = [_without_eccentricity(m, calibration, _placement(m.shot, calibration)) for m in held_out]
    result = _assessed(calibration, field, fresh, parameters, repeated)
    progress("done", 1.0)
    return result


def calibrate_from_points(
    shots: Sequence[Shot],
    field: ControlField,
    sensors: tuple[Sensor, Sensor],
    parameters: CalibrationParameters | None = None,
    progress: Progress = silent,
    *,
    verify: int = 0,
    rig_name: str = "rig",
) -> CalibrationResult:
    """Return the rig that took shots of a control field, from coordinates.

    Parameters
    ----------
    shots
        Image points of each shot; the first defines object space.
    field
        The control field.
    sensors
        Sensors of the left and the right camera.
    parameters
        Parameters of the solution and of the depth of field.
    progress
        Called at the start of each step.
    verify
        Number of trailing shots held out for verification.
    rig_name
        Name of the rig.

    Returns
    -------
    CalibrationResult
        The rig and its quality.

    Raises
    ------
    CalibrationError
        If no calibration can be made.
    """
    parameters = parameters or CalibrationParameters()
    n_adjusted = len(shots) - verify
    kept, repeated = _without_repeated(shots, parameters)
    adjusted = [shots[k] for k in kept if k < n_adjusted]
    held_out = [shots[k] for k in kept if k >= n_adjusted]
    calibration = calibrate_checked(
        adjusted, sensors, parameters.solve, parameters.plausibility, rig_name, part(progress, 0.0, 0.9)
    )
    progress("assess", 0.9)
    result = _assessed(calibration, field, held_out, parameters, repeated)
    progress("done", 1.0)
    return result


def _without_repeated(
    shots: Sequence[Shot], parameters: CalibrationParameters
) -> tuple[list[int], tuple[Flag, ...]]:
    """Return the indices of the shots that count, and a flag for each that repeats an earlier one."""
    repeated = repeated_shots(shots, parameters.plausibility)
    flags = tuple(
        Flag(
            "shot-repeated",
            f"shot {shots[k].name} shows the board where shot {shots[first].name} shows it (image points differ by"
            f" {rms_px:.3f} px RMS); it counts once, and verifies nothing",
        )
        for k, (first, rms_px) in repeated.items()
    )
    return [k for k in range(len(shots)) if k not in repeated], flags


def _assessed(
    calibration: StereoCalibration,
    field: ControlField,
    held_out: Sequence[Shot],
    parameters: CalibrationParameters,
    repeated: tuple[Flag, ...],
) -> CalibrationResult:
    """Return a calibration with its flags, geometry and accuracy."""
    doubts = doubt_flags(calibration, parameters.plausibility, parameters.solve.fixed)
    calibration = replace(calibration, flags=(*calibration.flags, *repeated, *doubts))
    adjustment, cleaned = calibration.adjustment, calibration.without_blunders()
    rng = np.random.default_rng(0)  # the same standard deviations for the same images
    determined = np.all(np.isfinite(adjustment.covariance))
    samples = sample_rigs(adjustment, parameters.n_rig_samples, rng) if determined else ()
    control = np.concatenate([image.control_mm for image in calibration.shots[0].images])
    return CalibrationResult(
        calibration,
        field,
        stereo_geometry(calibration.rig, control, samples, parameters.f_number),
        calibration_accuracy(calibration.rig, cleaned, held_out),
        leave_one_out(adjustment, cleaned),
        tuple(held_out),
    )


def _check_images(shots: Sequence[tuple[Pixels, Pixels]], names: Sequence[str]) -> None:
    if not shots:
        raise CalibrationError("no image was given; give at least one stereo pair of the control field")
    for name, pair in zip(names, shots, strict=True):
        if pair[0].shape == pair[1].shape and np.array_equal(*pair):
            raise SameImageError(
                f"shot {name}: left and right are the same image; give the pair of two cameras"
            )
        for side, image, first in zip(SIDES, pair, shots[0], strict=True):
            if image.shape != first.shape:
                raise ImageSizeError(
                    f"shot {name}: the {side} image is {image.shape[1]} x {image.shape[0]} px, that of the first"
                    f" shot {first.shape[1]} x {first.shape[0]}; all shots must come from the same two cameras"
                )


def _check_field(field: ControlField, n_adjusted: int, parameters: CalibrationParameters) -> None:
    if len(field) > parameters.max_field_points:
        raise ControlFieldError(
            f"control field {field.name!r} has {len(field)} points; at most {parameters.max_field_points} are"
            " identified in images: leave out those that were not photographed"
        )
    if n_adjusted < 2 and flatness(field.points_mm) < parameters.solve.dlt.min_flatness:
        raise PlanarFieldError(
            f"the points of control field {field.name!r} lie in one plane: one shot of it cannot separate focal length"
            " and range; use pegs of different heights, or give several shots, tilted differently by 15 to 45 degrees"
        )


def _sensors(pair: tuple[Pixels, Pixels], parameters: CalibrationParameters) -> tuple[Sensor, Sensor]:
    def sensor(image: Pixels) -> Sensor:
        size = (image.shape[1], image.shape[0])
        if parameters.pixel_size_mm is None:
            return Sensor.of_cart(size)
        return Sensor(size, parameters.pixel_size_mm)

    left, right = sensor(pair[0]), sensor(pair[1])
    check_sensor(left, parameters.plausibility)
    return left, right


def _measure(
    name: str,
    pair: tuple[Pixels, Pixels],
    field: ControlField,
    sensors: tuple[Sensor, Sensor],
    lenses: tuple[Camera | None, Camera | None],
    parameters: CalibrationParameters,
) -> tuple[_MeasuredShot, tuple[Camera, Camera]]:
    """Return the identified targets of one shot, and both cameras, whose lenses are known in the next."""
    identification = replace(parameters.identification, estimate_aspect=parameters.solve.estimate_aspect)

    def side(c: int) -> tuple[ImagePoints, Float, Camera]:
        targets = find_targets(pair[c], parameters.targets)
        where = f"the {SIDES[c]} image of shot {name}"
        found = identify_targets(targets, field, sensors[c], identification, where, lenses[c])
        return found.points, _variances_px2(found.points, targets), found.camera

    (left, left_variances, left_camera), (right, right_variances, right_camera) = side(0), side(1)
    measured = _MeasuredShot(Shot(name, left, right), (left_variances, right_variances))
    return measured, (left_camera, right_camera)


def _variances_px2(points: ImagePoints, targets: Targets) -> Float:
    """Return the variances (n,) of the targets that are image points."""
    d = np.linalg.norm(points.pixels[:, None] - targets.pixels[None], axis=2)
    return np.asarray(targets.variance_px2[d.argmin(axis=1)])


def _placement(shot: Shot, calibration: StereoCalibration) -> RigidTransform:
    """Return the placement of a shot that was not adjusted, from its reconstructed points."""
    _, control, left, right = common_points(shot)
    return fit_rigid(control, reconstruct(calibration.rig, left, right))


def _without_eccentricity(
    measured: _MeasuredShot, calibration: StereoCalibration, placement: RigidTransform
) -> Shot:
    """Return the shot with the eccentricity of its marks subtracted; corners have none."""
    rig, shot = calibration.rig, measured.shot
    if measured.variances_px2 is None:
        return shot
    left, right = (
        replace(image, pixels=image.pixels - eccentricity_px(camera, placement, image.control_mm, variances))
        for image, camera, variances in zip(
            shot.images, (rig.left, rig.right), measured.variances_px2, strict=True
        )
    )
    return Shot(shot.name, left, right)
