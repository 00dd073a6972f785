"""Initial values: interior orientations from which the adjustment of a camera is tried.

Least squares has local minima where the depth of the control points is small: another focal length at another
distance, or a principal point far off the plate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
from spinewatch.calibration.solve.dlt import MIN_DLT_POINTS, DltParameters, check_solvable, solve_dlt
from spinewatch.calibration.solve.orientation import MIN_POSE_POINTS, solve_pose, with_orientation
from spinewatch.camera import Camera


@dataclass(frozen=True)
class InitialValueParameters:
    """Which interior orientations are tried.

    Attributes
    ----------
    focal_factors
        Focal lengths beside the first, as multiples of it.
    principal_point_shifts
        Principal points beside the centre, in widths and heights of the plate.
    focal_widths
        Focal lengths when the direct linear transformation fails, in widths of the plate.
    max_focal_widths
        Greatest focal length that shots of a plane determine, in widths of the plate.
    min_mirror_gain
        Factor by which a mirrored field must reduce the residuals for the field to count as mirrored.
    """

    focal_factors: tuple[float, ...] = (0.8, 1.25)
    principal_point_shifts: tuple[tuple[float, float], ...] = (
        (-2.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (2.0, 0.0), (0.0, -1.0), (0.0, 1.0),
    )  # fmt: skip
    focal_widths: tuple[float, ...] = (1.0, 1.6, 3.0, 6.0)
    max_focal_widths: float = 100.0
    min_mirror_gain: float = 2.0


def initial_cameras(
    images: Sequence[ImagePoints],
    sensor: Sensor,
    where: str,
    focal_length_mm: float | None = None,
    parameters: InitialValueParameters | None = None,
    dlt: DltParameters | None = None,
) -> list[Camera]:
    """Return interior orientations to adjust from, the most probable first.

    A shot in relief gives a direct linear transformation, several tilted shots of a plane the focal length. Other
    focal lengths are added with the principal point at the centre, and, for a shot in relief, the same focal length
    with other principal points.

    Parameters
    ----------
    images
        Images of one camera, one per shot.
    sensor
        Its sensor.
    where
        Name of the camera in error messages.
    focal_length_mm
        Focal length when it is given, mm; it is then the only one.
    parameters
        What is tried.
    dlt
        How the direct linear transformation is solved.

    Returns
    -------
    list of Camera
        Cameras whose exterior orientation is not meaningful.

    Raises
    ------
    PlanarFieldError
        If the only shots are of a plane, and there are fewer than two.
    TooFewPointsError
        If a shot has too few points.
    UndeterminedError
        If shots of a plane are tilted too little.
    MirroredFieldError
        If only the mirrored field fits.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, field = table_3_3_rig().left, pegboard_1995()
    >>> image = ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm))
    >>> found = initial_cameras([image], Sensor.of_camera(camera), "the camera")
    >>> len(found), abs(found[0].focal_length_mm - camera.focal_length_mm) < 0.01
    (9, True)
    """
    parameters, dlt = parameters or InitialValueParameters(), dlt or DltParameters()
    if focal_length_mm is not None:
        return [sensor.camera(focal_length_mm=focal_length_mm)]
    relief = [flatness(image.control_mm) for image in images]
    in_relief = [
        (len(image) * depth, image)
        for image, depth in zip(images, relief, strict=True)
        if len(image) >= MIN_DLT_POINTS and depth >= dlt.min_flatness
    ]
    if in_relief:
        _, best = max(in_relief, key=lambda entry: entry[0])
        return _from_relief(best, sensor, where, parameters, dlt)
    planes = [
        image
        for image, depth in zip(images, relief, strict=True)
        if len(image) >= MIN_POSE_POINTS and depth < dlt.min_flatness
    ]
    if len(planes) < 2:
        check_solvable(max(images, key=len), where, dlt)
    if len(planes) < len(images):
        raise TooFewPointsError(
            f"{where}: a shot has too few control points; show at least {MIN_DLT_POINTS} pegs in each"
        )
    focal = focal_length_from_planes(planes, sensor, where, parameters)
    return [sensor.camera(focal_length_mm=f * focal) for f in (1.0, *parameters.focal_factors)]


def focal_length_from_planes(
    images: Sequence[ImagePoints],
    sensor: Sensor,
    where: str,
    parameters: InitialValueParameters | None = None,
) -> float:
    """Return the focal length of shots of a plane, with the principal point at the centre of the plate.

    The columns of a homography are images of orthogonal vectors of equal length, which gives two equations linear in
    1 / f^2 per shot.

    Parameters
    ----------
    images
        Two or more shots of a plane, tilted differently.
    sensor
        The sensor.
    where
        Name of the camera in error messages.
    parameters
        Greatest focal length.

    Returns
    -------
    float
        f, mm.

    Raises
    ------
    UndeterminedError
        If the planes are nearly parallel to the plate.

    References
    ----------
    Z. Zhang, "A flexible new technique for camera calibration", IEEE PAMI 22 (2000) 1330-1334, eqs 3 and 4.
    """
    parameters = parameters or InitialValueParameters()
    coefficients, constants = [], []
    for image in images:
        xy = sensor.camera().plate(image.pixels)
        H, _ = cv2.findHomography(_in_plane(image.control_mm), xy, 0)
        (a, b, c), (d, e, g) = H[:, 0], H[:, 1]
        coefficients += [a * d + b * e, a * a + b * b - d * d - e * e]
        constants += [-c * g, g * g - c * c]
    A, y = np.array(coefficients), np.array(constants)
    inverse_square = float(A @ y / (A @ A)) if len(A) and A @ A > 0 else 0.0
    width = float(sensor.plate_mm[0])
    if not inverse_square > (1 / (parameters.max_focal_widths * width)) ** 2:
        raise UndeterminedError(
            f"{where}: the shots of the plane are tilted too little to determine the focal length; tilt the board by"
            " 30 degrees or more, in different directions, or use a board with pegs of different heights",
            ("f",),
        )
    return 1 / float(np.sqrt(inverse_square))


def _from_relief(
    image: ImagePoints, sensor: Sensor, where: str, parameters: InitialValueParameters, dlt: DltParameters
) -> list[Camera]:
    try:
        direct = solve_dlt(image, sensor, where, dlt).camera
    except PlanarFieldError:
        raise
    except CalibrationError as error:
        # With little depth in the image noise can mirror the DLT; any focal length is then a better initial value.
        return _from_focal_lengths(image, sensor, parameters, error)
    f = direct.focal_length_mm
    others = [sensor.camera(focal_length_mm=factor * f) for factor in parameters.focal_factors]
    shifts = [(float(a), float(b)) for a, b in parameters.principal_point_shifts * sensor.plate_mm]
    return [direct, *others, *(sensor.camera(focal_length_mm=f, principal_point_mm=s) for s in shifts)]


def _from_focal_lengths(
    image: ImagePoints, sensor: Sensor, parameters: InitialValueParameters, dlt_error: CalibrationError
) -> list[Camera]:
    """Return cameras of several focal lengths; raise the error of the DLT when the mirrored field fits them better."""
    width = float(sensor.plate_mm[0])
    cameras = [sensor.camera(focal_length_mm=f * width) for f in parameters.focal_widths]
    mirrored = replace(image, control_mm=image.control_mm * (1, -1, 1))
    as_given, as_mirrored = (min(_median_residual_px(i, c) for c in cameras) for i in (image, mirrored))
    if parameters.min_mirror_gain * as_mirrored < as_given:
        raise dlt_error
    return cameras


def _median_residual_px(image: ImagePoints, camera: Camera) -> float:
    """Return the median coordinate residual of an image with this interior orientation, infinite without a pose."""
    try:
        oriented = with_orientation(camera, solve_pose(image, camera))
    except ConvergenceError:
        return float("inf")
    with np.errstate(all="ignore"):
        residual = np.abs(oriented.project(image.control_mm) - image.pixels)
    return float(np.median(np.nan_to_num(residual, nan=np.inf)))


def _in_plane(points_mm: Float) -> Float:
    """Return coordinates (n, 2) of points (n, 3) along their two largest principal axes."""
    centred = points_mm - points_mm.mean(axis=0)
    axes = np.linalg.svd(centred)[2][:2]
    return np.asarray(centred @ axes.T)
