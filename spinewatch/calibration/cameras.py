"""Any number of cameras from coordinates of one control field: resection of each, then one adjustment of all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from spinewatch.calibration.errors import TooFewPointsError
from spinewatch.calibration.flags import calibration_flags
from spinewatch.calibration.plausibility.cameras import aspect_doubts, check_cameras, principal_point_doubts
from spinewatch.calibration.plausibility.held_values import held_value_doubts
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.plausibility.points import check_image_points, check_sensor
from spinewatch.calibration.points import ImagePoints, Sensor, Shot, check_consistent
from spinewatch.calibration.quality.accuracy import ShotAccuracy, shot_accuracy
from spinewatch.calibration.solve.block import Block, ImageIndex
from spinewatch.calibration.solve.blunders import Blunder, adjust_without_blunders
from spinewatch.calibration.solve.bundle import BundleAdjustment
from spinewatch.calibration.solve.dlt import MIN_DLT_POINTS
from spinewatch.calibration.solve.orientation import MIN_POSE_POINTS
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.solve.resection import Resection, resect
from spinewatch.camera import Camera, Rig
from spinewatch.flags import Flag
from spinewatch.progress import Progress, silent

CameraImages = Mapping[str, ImagePoints]
"""Image points of one camera by shot."""


@dataclass(frozen=True, eq=False)
class CalibratedCameras:
    """Cameras in the object space that the first shot defines, and their accuracy.

    Attributes
    ----------
    cameras
        The cameras by name.
    shots
        Names of the shots.
    adjustment
        The adjustment; its cameras and placements are in the order of ``cameras`` and ``shots``.
    blunders
        Points that were removed.
    pairs
        Residuals of the control points reconstructed by every two cameras.
    flags
        Flags of the calibration.
    """

    cameras: Mapping[str, Camera]
    shots: tuple[str, ...]
    adjustment: BundleAdjustment
    blunders: tuple[Blunder, ...]
    pairs: Mapping[tuple[str, str], tuple[ShotAccuracy, ...]]
    flags: tuple[Flag, ...]

    def sd(self, name: str) -> dict[str, float]:
        """Return the standard deviations of the adjusted parameters of a camera.

        Parameters
        ----------
        name
            Name of the camera.

        Returns
        -------
        dict of str to float
            Standard deviation by parameter, mm, degrees and 1/mm^k.
        """
        return self.adjustment.camera_sd(list(self.cameras).index(name))


def calibrate_cameras(
    images: Mapping[str, CameraImages],
    sensor: Sensor,
    parameters: SolveParameters | None = None,
    plausibility: CalibrationLimits | None = None,
) -> CalibratedCameras:
    """Return the cameras that took images of one control field.

    With one shot this is a space resection of each camera; with several, the placements connect the cameras. The
    cameras may have any position.

    Parameters
    ----------
    images
        Image points by camera and shot. Shots of the same name are the same placement of the field; the first shot of
        the first camera defines object space, and every camera must have it in view.
    sensor
        Sensor of all cameras.
    parameters
        How to solve.
    plausibility
        Limits of plausible cameras.

    Returns
    -------
    CalibratedCameras
        The cameras and their accuracy.

    Raises
    ------
    TooFewPointsError
        If a camera has too few points of the first shot, or no camera has enough of another.
    PointsError
        If a point has different object coordinates in two images, or image points are no pixels of their image.
    PixelSizeError, ImplausibleCalibrationError
        If pixel size, range, focal length or principal point cannot be those of a camera.
    CalibrationError
        As `resect`, naming the camera.
    """
    parameters, plausibility = parameters or SolveParameters(), plausibility or CalibrationLimits()
    shots = tuple(dict.fromkeys(shot for by_shot in images.values() for shot in by_shot))
    if not shots:
        raise TooFewPointsError(
            f"no image point was given; give at least {MIN_DLT_POINTS} of a control field for each camera"
        )
    for name, by_shot in images.items():
        _check_first_shot(name, shots[0], len(by_shot.get(shots[0], ())))
    check_consistent((name, image) for name, by_shot in images.items() for image in by_shot.values())
    check_sensor(sensor, plausibility)
    for name, by_shot in images.items():
        named = ((f"camera {name}, shot {shot}", image) for shot, image in by_shot.items())
        check_image_points(named, sensor, plausibility)
    block = resected_block(
        [[by_shot.get(shot) for shot in shots] for by_shot in images.values()],
        [sensor] * len(images),
        [f"camera {name}" for name in images],
        shots,
        parameters,
    )
    adjustment, blunders = adjust_without_blunders(block, parameters.blunders)
    cameras = dict(zip(images, adjustment.block.cameras, strict=True))
    names = tuple(images)
    check_cameras([f"camera {name}" for name in names], adjustment, plausibility, is_rig=False)
    flags = (
        *calibration_flags(adjustment, blunders, names, shots),
        *aspect_doubts(adjustment, names, plausibility),
        *principal_point_doubts(adjustment, names, plausibility),
        *held_value_doubts(adjustment, names, parameters.fixed, plausibility),
    )
    return CalibratedCameras(
        cameras, shots, adjustment, blunders, _pair_accuracy(cameras, shots, adjustment), flags
    )


def resected_block(
    images: Sequence[Sequence[ImagePoints | None]],
    sensors: Sequence[Sensor],
    camera_labels: Sequence[str],
    shot_names: Sequence[str],
    parameters: SolveParameters,
    progress: Progress = silent,
) -> Block:
    """Return the block of cameras that were each solved alone: the initial values of their common adjustment.

    Parameters
    ----------
    images
        Image points of each camera in each shot; None where it has none.
    sensors
        Sensor of each camera.
    camera_labels
        Names of the cameras in error messages.
    shot_names
        Names of the shots.
    parameters
        How to solve.
    progress
        Called at the start of each camera.

    Returns
    -------
    Block
        The block; images with fewer than `MIN_POSE_POINTS` points are left out, and a placement is that of the first
        camera that has it in view.

    Raises
    ------
    TooFewPointsError
        If no camera has enough points of a shot.
    CalibrationError
        As `resect`, naming the camera.
    """
    usable = [
        [image if image is not None and len(image) >= MIN_POSE_POINTS else None for image in by_shot]
        for by_shot in images
    ]
    resections: list[Resection] = []
    for by_shot, sensor, label in zip(usable, sensors, camera_labels, strict=True):
        progress(f"solve {label}", len(resections) / len(usable))
        resections.append(resect(by_shot, sensor, parameters, label))
    placements = []
    for s, shot in enumerate(shot_names):
        placement = next((r.placements[s] for r in resections if s in r.placements), None)
        if placement is None:
            raise TooFewPointsError(
                f"no camera has {MIN_POSE_POINTS} points of shot {shot} in view; leave the shot out"
            )
        placements.append(placement)
    return Block(
        tuple(r.camera for r in resections),
        tuple(placements),
        measured_images(usable),
        tuple(r.free for r in resections),
    )


def measured_images(images: Iterable[Sequence[ImagePoints | None]]) -> dict[ImageIndex, ImagePoints]:
    """Return image points by camera and shot.

    Parameters
    ----------
    images
        Image points of each camera in each shot.

    Returns
    -------
    dict of ImageIndex to ImagePoints
        Images that determine an exterior orientation: `MIN_POSE_POINTS` or more.
    """
    return {
        (c, s): image
        for c, by_shot in enumerate(images)
        for s, image in enumerate(by_shot)
        if image is not None and len(image) >= MIN_POSE_POINTS
    }


def _check_first_shot(camera: str, shot: str, n_points: int) -> None:
    if n_points < MIN_POSE_POINTS:
        raise TooFewPointsError(
            f"camera {camera} has {n_points} points of shot {shot}, which defines object space; show every camera"
            f" at least {MIN_DLT_POINTS} points of it"
        )


def _pair_accuracy(
    cameras: Mapping[str, Camera], shots: Sequence[str], adjustment: BundleAdjustment
) -> dict[tuple[str, str], tuple[ShotAccuracy, ...]]:
    """Return the reconstruction of the common points of two cameras, by pair; pairs without any are left out."""
    images = adjustment.block.images
    out = {}
    for (a, left), (b, right) in combinations(enumerate(cameras), 2):
        rig = Rig(f"{left}, {right}", cameras[left], cameras[right])
        by_shot = [
            shot_accuracy(rig, Shot(shot, images[a, s], images[b, s]), used=True, defines_object_space=s == 0)
            for s, shot in enumerate(shots)
            if (a, s) in images and (b, s) in images
        ]
        reconstructed = tuple(
            accuracy
            for accuracy in by_shot
            if np.all(np.isfinite(accuracy.residuals_mm)) and len(accuracy.ids) > 1
        )
        if reconstructed:
            out[left, right] = reconstructed
    return out
