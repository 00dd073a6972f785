"""Exterior orientation: the motion from object space to camera space, and its solution with a known interior."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.points import ImagePoints
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import angles_from_rotation, rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform

MIN_POSE_POINTS = 4
"""Points of one image that determine its exterior orientation uniquely."""

_FLIP = np.diag([1.0, -1.0, -1.0])  # between the camera's axes and OpenCV's: y down, z forwards


def object_to_camera(camera: Camera) -> RigidTransform:
    """Return the exterior orientation of a camera as a motion.

    Parameters
    ----------
    camera
        The camera.

    Returns
    -------
    RigidTransform
        Motion from object space to camera space.
    """
    return RigidTransform(camera.M, -camera.M @ camera.centre)


def with_orientation(camera: Camera, to_camera: RigidTransform) -> Camera:
    """Return a camera in another position, the inverse of `object_to_camera`.

    Parameters
    ----------
    camera
        Camera whose interior orientation is taken over.
    to_camera
        Motion from object space to camera space.

    Returns
    -------
    Camera
        The camera with this exterior orientation.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> rig = table_3_3_rig()
    >>> moved = with_orientation(rig.left, object_to_camera(rig.right))
    >>> bool(np.allclose(moved.position_mm, rig.right.position_mm))
    True
    """
    x, y, z = (float(v) for v in -to_camera.rotation.T @ to_camera.translation_mm)
    return replace(camera, position_mm=(x, y, z), rotation_deg=angles_from_rotation(to_camera.rotation))


def solve_pose(image: ImagePoints, camera: Camera) -> RigidTransform:
    """Return the exterior orientation of one image, the interior orientation being known.

    Parameters
    ----------
    image
        Image points, at least `MIN_POSE_POINTS`.
    camera
        Camera of which only the interior orientation is used.

    Returns
    -------
    RigidTransform
        Motion from the board's frame to camera space.

    Raises
    ------
    ConvergenceError
        If the points determine no pose.

    References
    ----------
    G. Terzakis, M. Lourakis, "A consistently fast and globally optimal solution to the perspective-n-point problem",
    ECCV 2020.
    """
    try:
        _, rotation, translation = cv2.solvePnP(
            np.ascontiguousarray(image.control_mm),
            np.ascontiguousarray(opencv_directions(camera, image.pixels)),
            np.eye(3),
            None,
            flags=cv2.SOLVEPNP_SQPNP,
        )
    except cv2.error as error:
        raise ConvergenceError(
            "the points determine no pose of the board; check their coordinates, which are in mm and px"
        ) from error
    R = rotation_from_vector(np.asarray(rotation, dtype=np.float64)[:, 0])
    return from_opencv_pose(R, np.asarray(translation, dtype=np.float64)[:, 0])


def opencv_directions(camera: Camera, pixels: Float) -> Float:
    """Return image points of unit focal length without distortion, in OpenCV's axes.

    Parameters
    ----------
    camera
        The camera.
    pixels
        (u, v), shape (n, 2), px.

    Returns
    -------
    Float
        (x, y), x right and y down, shape (n, 2), without unit.
    """
    return np.asarray(camera.undistort(camera.plate(pixels)) / camera.focal_length_mm * (1, -1))


def from_opencv_pose(R: Float, t_mm: Float) -> RigidTransform:
    """Return the motion to camera space of a pose in OpenCV's axes.

    Parameters
    ----------
    R
        Rotation from object axes to OpenCV's camera axes, shape (3, 3).
    t_mm
        Translation, shape (3,), mm.

    Returns
    -------
    RigidTransform
        Motion from object space to camera space.
    """
    return RigidTransform(_FLIP @ R, _FLIP @ t_mm)
