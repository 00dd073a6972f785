"""Both cameras of a rig from coordinates: the special case of two cameras, left and right of an upright board."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.calibration.cameras import measured_images, resected_block
from spinewatch.calibration.errors import BoardOrientationError, SidesSwappedError, TooFewPointsError
from spinewatch.calibration.flags import calibration_flags
from spinewatch.calibration.points import Sensor, Shot, check_consistent
from spinewatch.calibration.solve.block import Block
from spinewatch.calibration.solve.blunders import Blunder, adjust_without_blunders
from spinewatch.calibration.solve.bundle import BundleAdjustment
from spinewatch.calibration.solve.dlt import MIN_DLT_POINTS
from spinewatch.calibration.solve.orientation import MIN_POSE_POINTS
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.camera import Camera, Rig
from spinewatch.errors import SameImageError
from spinewatch.flags import Flag
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.imaging.frame import SIDES
from spinewatch.progress import Progress, part, silent


@dataclass(frozen=True, eq=False)
class StereoCalibration:
    """A calibrated rig and its uncertainty.

    Attributes
    ----------
    rig
        The rig.
    shots
        Shots that were adjusted, with all their points; the first defines object space.
    adjustment
        Adjustment of both cameras, left first.
    blunders
        Points that were removed.
    flags
        Flags of the calibration.
    """

    rig: Rig
    shots: tuple[Shot, ...]
    adjustment: BundleAdjustment
    blunders: tuple[Blunder, ...]
    flags: tuple[Flag, ...]

    @property
    def placements(self) -> tuple[RigidTransform, ...]:
        """Motion from the board's frame to object space in each shot."""
        return self.adjustment.block.placements

    @property
    def free(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the adjusted parameters by side."""
        return dict(zip(SIDES, self.adjustment.block.free, strict=True))

    @property
    def sd(self) -> Mapping[str, Mapping[str, float]]:
        """Standard deviations of the adjusted parameters by side; NaN without redundancy."""
        return {side: self.adjustment.camera_sd(c) for c, side in enumerate(SIDES)}

    @property
    def rms_px(self) -> Mapping[str, float]:
        """Image RMS per coordinate by side, px."""
        return {side: self.adjustment.camera_rms_px(c) for c, side in enumerate(SIDES)}

    def without_blunders(self) -> tuple[Shot, ...]:
        """Return the shots without the removed points.

        Returns
        -------
        tuple of Shot
            The shots in the same order.
        """
        removed = {(b.camera, b.shot, b.id) for b in self.blunders}
        cleaned = []
        for s, shot in enumerate(self.shots):
            left, right = (
                image.keep(np.array([(c, s, id_) not in removed for id_ in image.ids], dtype=bool))
                for c, image in enumerate(shot.images)
            )
            cleaned.append(Shot(shot.name, left, right))
        return tuple(cleaned)


def calibrate_stereo(
    shots: Sequence[Shot],
    sensors: tuple[Sensor, Sensor],
    parameters: SolveParameters | None = None,
    name: str = "rig",
    progress: Progress = silent,
) -> StereoCalibration:
    """Return the rig that took shots of one control field.

    Parameters
    ----------
    shots
        The shots, the first of which defines object space.
    sensors
        Sensors of the left and the right camera.
    parameters
        How to solve.
    name
        Name of the rig.
    progress
        Called at the start of each step.

    Returns
    -------
    StereoCalibration
        The rig and its uncertainty.

    Raises
    ------
    TooFewPointsError
        If the first shot, or both images of another, have too few points.
    SameImageError
        If left and right of a shot are the same.
    BoardOrientationError, SidesSwappedError
        If the board is upside down or the sides are exchanged.
    CalibrationError
        As `resect`, naming the side.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> rig, field = table_3_3_rig(), pegboard_1995()
    >>> left, right = (
    ...     ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm))
    ...     for camera in (rig.left, rig.right)
    ... )
    >>> sensors = (Sensor.of_camera(rig.left), Sensor.of_camera(rig.right))
    >>> round(calibrate_stereo([Shot("1", left, right)], sensors).rig.baseline_mm, 3) == round(rig.baseline_mm, 3)
    True
    """
    parameters = parameters or SolveParameters()
    _check_shots(shots)
    block = resected_block(
        [[shot.images[c] for shot in shots] for c in range(len(SIDES))],
        sensors,
        [f"the {side} camera" for side in SIDES],
        [shot.name for shot in shots],
        parameters,
        part(progress, 0.0, 0.7),
    )
    progress("adjust both cameras", 0.7)
    if parameters.check_orientation:
        _check_orientation(block.cameras, shots[0])
    return _adjusted(block, shots, parameters, name)


def readjust(
    calibration: StereoCalibration, shots: Sequence[Shot], parameters: SolveParameters | None = None
) -> StereoCalibration:
    """Return a calibration adjusted again, to improved coordinates of the same points.

    Parameters
    ----------
    calibration
        Initial values.
    shots
        The same shots with improved image points.
    parameters
        How to solve; the free parameters are those of the calibration.

    Returns
    -------
    StereoCalibration
        The rig and its uncertainty.

    Raises
    ------
    PoorFitError
        If too many points would have to be removed.
    ConvergenceError
        If the adjustment loses the points from view.
    """
    block = calibration.adjustment.block
    images = measured_images([[shot.images[c] for shot in shots] for c in range(len(SIDES))])
    full = Block(block.cameras, block.placements, images, block.free)
    return _adjusted(full, shots, parameters or SolveParameters(), calibration.rig.name)


def _adjusted(
    block: Block, shots: Sequence[Shot], parameters: SolveParameters, name: str
) -> StereoCalibration:
    adjustment, blunders = adjust_without_blunders(block, parameters.blunders)
    left, right = adjustment.block.cameras
    flags = calibration_flags(adjustment, blunders, SIDES, [shot.name for shot in shots])
    return StereoCalibration(Rig(name, left, right), tuple(shots), adjustment, blunders, flags)


def _check_shots(shots: Sequence[Shot]) -> None:
    if not shots:
        raise TooFewPointsError("no shot of a control field was given; give at least one stereo pair")
    for side, image in zip(SIDES, shots[0].images, strict=True):
        if len(image) < MIN_POSE_POINTS:
            raise TooFewPointsError(
                f"the {side} image of the first shot, {shots[0].name}, has {len(image)} control points; the first shot"
                f" defines object space and needs at least {MIN_DLT_POINTS} in both images"
            )
    for shot in shots:
        if np.array_equal(shot.left.pixels, shot.right.pixels):
            raise SameImageError(
                f"shot {shot.name}: left and right have the same image points; give those of two cameras"
            )
    check_consistent(
        (f"the {side} image of shot {shot.name}", image)
        for shot in shots
        for side, image in zip(SIDES, shot.images, strict=True)
    )


def _check_orientation(cameras: tuple[Camera, ...], first: Shot) -> None:
    for side, camera, image in zip(SIDES, cameras, first.images, strict=True):
        if camera.centre[2] < image.control_mm[:, 2].mean():
            raise BoardOrientationError(
                f"the {side} camera would lie below the board: Z of the control field must point up to the"
                " cameras; check the signs of its coordinates"
            )
        if camera.M[0, 0] <= 0:
            angle = abs(float(np.degrees(np.arctan2(camera.M[1, 0], camera.M[0, 0]))))
            raise BoardOrientationError(
                f"the board is rotated by {angle:.0f} degrees in the {side} image: lay it so that its X runs to the"
                " right in both images, or mount the cameras upright"
            )
    left, right = cameras
    if left.M[0] @ (right.centre - left.centre) < 0:
        raise SidesSwappedError("the left image was taken by the right camera; exchange left and right")
