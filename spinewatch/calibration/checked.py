"""Calibration of a rig with its checks: what fits nothing is refused with the likeliest cause."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import combinations

from spinewatch.calibration.errors import (
    BoardOrientationError,
    CalibrationError,
    ConvergenceError,
    ImplausibleCalibrationError,
    PixelSizeError,
    PoorFitError,
    ShotsDisagreeError,
    SidesSwappedError,
    UndeterminedError,
)
from spinewatch.calibration.plausibility.cameras import aspect_doubts, check_cameras, principal_point_doubts
from spinewatch.calibration.plausibility.fit import FitDoubts, fit_doubts
from spinewatch.calibration.plausibility.held_values import held_value_doubts
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.plausibility.points import check_image_points, check_sensor
from spinewatch.calibration.points import Sensor, Shot
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import StereoCalibration, calibrate_stereo
from spinewatch.flags import Flag
from spinewatch.imaging.frame import SIDES
from spinewatch.progress import Progress, silent

_DIAGNOSED = (PoorFitError, ConvergenceError, BoardOrientationError, SidesSwappedError, UndeterminedError)
_CAMERA_NAMES = tuple(f"the {side} camera" for side in SIDES)

Sensors = tuple[Sensor, Sensor]
"""Sensors of the left and the right camera."""


def calibrate_checked(
    shots: Sequence[Shot],
    sensors: Sensors,
    solve: SolveParameters | None = None,
    parameters: CalibrationLimits | None = None,
    name: str = "rig",
    progress: Progress = silent,
) -> StereoCalibration:
    """Return the rig that took shots of one control field, if it is plausible.

    When the shots fit no rig, the aspect of the pixels is adjusted, and other orders and pairings of the images are
    tried; the error names the one that fits.

    Parameters
    ----------
    shots
        The shots, the first of which defines object space.
    sensors
        Sensors of the left and the right camera.
    solve
        How to solve.
    parameters
        Limits of a plausible calibration.
    name
        Name of the rig.
    progress
        Called at the start of each step.

    Returns
    -------
    StereoCalibration
        The rig.

    Raises
    ------
    PixelSizeError
        If the pixel size is impossible, or the shots fit only with another aspect.
    PointsError
        If image points are normalized or outside the image.
    ShotsDisagreeError
        If several shots do not agree with one pair of cameras.
    ImplausibleCalibrationError
        If the cameras cannot be those of a rig.
    CalibrationError
        As `calibrate_stereo`.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> rig, field = table_3_3_rig(), pegboard_1995()
    >>> ids = ["3", "4", "5", "6", "9", "10", "11", "12", "15", "16", "17", "18"]
    >>> near = field.take(ids)
    >>> left, right = (
    ...     ImagePoints.build(ids, near / 1000, camera.project(near))
    ...     for camera in (rig.left, rig.right)
    ... )
    >>> sensors = (Sensor.of_camera(rig.left), Sensor.of_camera(rig.right))
    >>> try:
    ...     calibrate_checked([Shot("1", left, right)], sensors)
    ... except ImplausibleCalibrationError as error:
    ...     print(str(error).split(";")[0])
    the range of the control field is 0.721 mm, outside 100 to 20000 mm: control points in metres?
    """
    solve, parameters = solve or SolveParameters(), parameters or CalibrationLimits()
    for c, (side, sensor) in enumerate(zip(SIDES, sensors, strict=True)):
        check_sensor(sensor, parameters)
        images = ((f"the {side} image of shot {shot.name}", shot.images[c]) for shot in shots)
        check_image_points(images, sensor, parameters)
    try:
        calibration = calibrate_stereo(shots, sensors, solve, name, progress)
    except _DIAGNOSED as error:
        if (cause := _cause(shots, sensors, solve, parameters)) is not None:
            raise cause from error
        raise
    doubts = _doubts(calibration, parameters)
    if doubts.refused:
        raise _cause(shots, sensors, solve, parameters) or _unexplained(doubts.refused, len(shots))
    check_cameras(_CAMERA_NAMES, calibration.adjustment, parameters, is_rig=True)
    return calibration


def doubt_flags(
    calibration: StereoCalibration,
    parameters: CalibrationLimits | None = None,
    held: Collection[str] = (),
) -> tuple[Flag, ...]:
    """Return the flags of a calibration that is not refused but doubtful.

    Parameters
    ----------
    calibration
        The calibration.
    parameters
        Limits of a plausible calibration.
    held
        Names of parameters that were held at values that a person gave.

    Returns
    -------
    tuple of Flag
        ``pixel-size-doubtful`` per camera, ``calibration-poor`` per reason and ``held-value-contradicted`` per camera
        and parameter.
    """
    parameters = parameters or CalibrationLimits()
    doubts = _doubts(calibration, parameters)
    return (
        *aspect_doubts(calibration.adjustment, _CAMERA_NAMES, parameters),
        *principal_point_doubts(calibration.adjustment, _CAMERA_NAMES, parameters),
        *(Flag("calibration-poor", reason) for reason in (*doubts.refused, *doubts.flagged)),
        *held_value_doubts(calibration.adjustment, _CAMERA_NAMES, held, parameters),
    )


def _doubts(calibration: StereoCalibration, parameters: CalibrationLimits) -> FitDoubts:
    return fit_doubts(calibration.rig, calibration.without_blunders(), calibration.adjustment, parameters)


def _unexplained(reasons: Sequence[str], n_shots: int) -> CalibrationError:
    if n_shots == 1:
        return ImplausibleCalibrationError(
            f"the calibration determines no rig: {'; '.join(reasons)}; show more points, over the whole image and at"
            " different heights, and check pixel size and control field"
        )
    return ShotsDisagreeError(
        f"the shots do not agree with one pair of cameras: {'; '.join(reasons)}; give LEFT RIGHT of each shot, both of"
        " the same moment, and leave out a shot before which a camera was moved"
    )


def _cause(
    shots: Sequence[Shot], sensors: Sensors, solve: SolveParameters, parameters: CalibrationLimits
) -> CalibrationError | None:
    """Return the error that names what would make the shots fit, or None when nothing does."""
    if not solve.estimate_aspect and "aspect" not in solve.fixed:
        found = _fitted(shots, sensors, replace(solve, estimate_aspect=True), parameters)
        if found is not None and (doubt := _aspect_error(found, sensors, parameters)) is not None:
            return doubt
    alternatives = _alternatives(shots) if len(shots) > 1 else iter(())
    for _, (cause, other) in zip(range(parameters.max_alternatives), alternatives, strict=False):
        if _fitted(other, sensors, solve, parameters) is not None:
            return ShotsDisagreeError(f"the shots do not agree with one pair of cameras: {cause}")
    return None


def _fitted(
    shots: Sequence[Shot], sensors: Sensors, solve: SolveParameters, parameters: CalibrationLimits
) -> StereoCalibration | None:
    """Return the calibration of the shots if nothing contradicts it, else None."""
    try:
        calibration = calibrate_stereo(shots, sensors, solve)
    except CalibrationError:
        return None
    doubts = _doubts(calibration, parameters)
    return None if doubts.refused or doubts.flagged else calibration


def _aspect_error(
    calibration: StereoCalibration, sensors: Sensors, parameters: CalibrationLimits
) -> PixelSizeError | None:
    """Return the error for pixels whose adjusted aspect differs from the assumed one, or None."""
    for c, sensor in enumerate(sensors):
        (width, height), camera = sensor.pixel_size_mm, calibration.adjustment.block.cameras[c]
        assumed, found = height / width, camera.pixel_size_mm[1] / camera.pixel_size_mm[0]
        if abs(found - assumed) > parameters.aspect * assumed:
            return PixelSizeError(
                f"the shots fit only with another pixel size: their pixels have an aspect (height over width) of"
                f" {found:.3f}, that of {width:.4g} x {height:.4g} mm is {assumed:.3f}; give the pixel size of the"
                " camera (--pixel-size), or adjust the aspect (--estimate-aspect)"
            )
    return None


def _alternatives(shots: Sequence[Shot]) -> Iterator[tuple[str, list[Shot]]]:
    """Yield likely mistakes with the shots as they would be without them."""
    n = len(shots)
    images = [image for shot in shots for image in shot.images]
    ordered = [
        Shot(shot.name, left, right) for shot, left, right in zip(shots, images[:n], images[n:], strict=True)
    ]
    yield (
        "they agree when all left images come before all right ones; give left, right, left, right",
        ordered,
    )
    for k, shot in enumerate(shots):
        yield (
            f"they agree when left and right of shot {shot.name} are exchanged; exchange them",
            [*shots[:k], Shot(shot.name, shot.right, shot.left), *shots[k + 1 :]],
        )
    for j, k in combinations(range(n), 2):
        paired = list(shots)
        paired[j] = Shot(shots[j].name, shots[k].left, shots[j].right)
        paired[k] = Shot(shots[k].name, shots[j].left, shots[k].right)
        yield (
            f"they agree when the left images of shots {shots[j].name} and {shots[k].name} are exchanged; give the two"
            " images of one moment as one shot",
            paired,
        )
    if n > 2:
        for k, shot in enumerate(shots):
            yield (
                f"all but shot {shot.name} agree: its two images are of different moments, or a camera was moved; leave"
                " it out",
                [*shots[:k], *shots[k + 1 :]],
            )
