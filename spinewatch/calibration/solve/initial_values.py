"""Starting values: cameras worth adjusting from, because least squares has local minima."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import (
    CalibrationError,
    ConvergenceError,
    PlanarFieldError,
    TooFewPointsError,
    UndeterminedError,
)
from spinewatch.calibration.points import ImagePoints, Sensor, flatness
from spinewatch.calibration.solve.dlt import MIN_FLATNESS, MIN_POINTS, refuse_unfit, solve_dlt
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import angles_from_rotation
from spinewatch.geometry.transforms import RigidTransform

_FLIP = np.diag([1.0, -1.0, -1.0])  # from camera axes to OpenCV's: y down, z forwards
_FOCAL_LADDER = (0.8, 1.25)
_SHIFTS = np.array([(-2.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (2.0, 0.0), (0.0, -1.0), (0.0, 1.0)])
_WIDTHS = (1.0, 1.6, 3.0, 6.0)


def start_cameras(
    images: Sequence[ImagePoints | None], sensor: Sensor, where: str, given_focal_mm: float | None = None
) -> list[Camera]:
    """Return interior orientations to start from, most trusted first; their exterior orientation is void.

    ``images`` are one camera's, one per shot. Any shot in relief gives a DLT; several tilted shots of a plane
    give the focal length by Zhang's constraints. Around it, other focal lengths are tried with the principal
    point at the centre of the plate, and the principal point far off it: weak depth has minima there too.

    Raises ``PlanarFieldError`` for a single plane, ``TooFewPointsError``, and what ``solve_dlt`` raises.
    """
    seen = [image for image in images if image is not None]
    if given_focal_mm is not None:
        return [sensor.camera(focal_length_mm=given_focal_mm)]
    in_relief = [i for i in seen if len(i) >= MIN_POINTS and flatness(i.control_mm) >= MIN_FLATNESS]
    if in_relief:
        best = max(in_relief, key=lambda i: len(i) * flatness(i.control_mm))
        return _around(best, sensor, where)
    flat = [image for image in seen if len(image) >= 4 and flatness(image.control_mm) < MIN_FLATNESS]
    if len(flat) < 2:
        refuse_unfit(max(seen, key=len), where)
    if len(flat) < len(seen):
        raise TooFewPointsError(
            f"{where}: a shot has too few control points; show at least {MIN_POINTS} pegs in each"
        )
    focal = focal_from_planes(flat, sensor, where)
    return [sensor.camera(focal_length_mm=f * focal) for f in (1.0, *_FOCAL_LADDER)]


def _around(image: ImagePoints, sensor: Sensor, where: str) -> list[Camera]:
    try:
        direct = solve_dlt(image, sensor, where).camera
    except PlanarFieldError:
        raise
    except CalibrationError as error:
        # Depth that hardly shows can turn the DLT over; any focal length is then a better start.
        mirrored = error
    else:
        f = direct.focal_length_mm
        ladder = [sensor.camera(focal_length_mm=r * f) for r in _FOCAL_LADDER]
        shifts = [(float(a), float(b)) for a, b in _SHIFTS * sensor.plate_mm]
        return [direct, *ladder, *(sensor.camera(focal_length_mm=f, principal_point_mm=s) for s in shifts)]
    width = float(sensor.plate_mm[0])
    cameras = [sensor.camera(focal_length_mm=f * width) for f in _WIDTHS]
    reflected = replace(image, control_mm=image.control_mm * (1, -1, 1))
    as_given, as_reflected = (min(_resection_miss(i, c) for c in cameras) for i in (image, reflected))
    if as_reflected < _CLEARLY * as_given:
        raise mirrored
    return cameras


_CLEARLY = 0.5


def _resection_miss(image: ImagePoints, camera: Camera) -> float:
    try:
        oriented = with_exterior(camera, exterior(image, camera))
    except ConvergenceError:
        return float("inf")
    with np.errstate(all="ignore"):
        miss = np.abs(oriented.project(image.control_mm) - image.pixels)
    return float(np.median(np.nan_to_num(miss, nan=np.inf)))


def focal_from_planes(images: Sequence[ImagePoints], sensor: Sensor, where: str) -> float:
    """Return f in mm from two or more tilted shots of a plane, by Zhang's two constraints on each homography.

    The principal point is taken at the centre of the plate. Raises ``UndeterminedError`` for parallel shots.
    """
    rows, right = [], []
    for image in images:
        xy = sensor.camera().plate(image.pixels)
        H, _ = cv2.findHomography(_in_plane(image.control_mm), xy, 0)
        (a, b, c), (d, e, g) = H[:, 0], H[:, 1]
        rows += [a * d + b * e, a * a + b * b - d * d - e * e]
        right += [-c * g, g * g - c * c]
    A, y = np.array(rows), np.array(right)
    inverse_square = float(A @ y / (A @ A)) if len(A) and A @ A > 0 else 0.0
    width = float(sensor.plate_mm[0])
    if not inverse_square > (0.01 / width) ** 2:
        raise UndeterminedError(
            f"{where}: the shots of the plane are tilted too little to tell the focal length; tilt the board by"
            " 30 degrees or more, in different directions, or use a board with pegs of different heights",
            ("f",),
        )
    return 1 / float(np.sqrt(inverse_square))


def _in_plane(points_mm: Float) -> Float:
    centred = points_mm - points_mm.mean(axis=0)
    axes = np.linalg.svd(centred)[2][:2]
    return np.asarray(centred @ axes.T)


def exterior(image: ImagePoints, camera: Camera) -> RigidTransform:
    """Return the motion from the board's frame to camera space of one shot, the interior orientation being known.

    Raises ``ConvergenceError`` when the points determine none.
    """
    ideal = camera.undistort(camera.plate(image.pixels)) / camera.focal_length_mm * (1, -1)
    try:
        _, rotation, translation = cv2.solvePnP(
            np.ascontiguousarray(image.control_mm),
            np.ascontiguousarray(ideal),
            np.eye(3),
            None,
            flags=cv2.SOLVEPNP_SQPNP,
        )
        R = np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64)
    except cv2.error as error:
        raise ConvergenceError(
            "the points determine no pose of the board; check their coordinates, which are in mm and px"
        ) from error
    return RigidTransform(_FLIP @ R, _FLIP @ np.asarray(translation, dtype=np.float64)[:, 0])


def with_exterior(camera: Camera, to_camera: RigidTransform) -> Camera:
    """Return the camera placed so that it has this motion from object space to camera space."""
    x, y, z = (float(v) for v in -to_camera.rotation.T @ to_camera.translation_mm)
    return Camera(
        (x, y, z),
        angles_from_rotation(to_camera.rotation),
        camera.focal_length_mm,
        camera.principal_point_mm,
        camera.radial,
        camera.decentering,
        camera.image_size_px,
        camera.pixel_size_mm,
    )


def to_camera_space(camera: Camera) -> RigidTransform:
    """Return the motion from object space to camera space."""
    return RigidTransform(camera.M, -camera.M @ camera.centre)
