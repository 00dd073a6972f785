"""Motion of vertebrae between two stages, relative to the reference triad; NumPy only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import SpinewatchError
from spinewatch.geometry.rotations import (
    cross_matrix,
    inverse_left_jacobian,
    variance_about,
    vector_from_rotation,
)
from spinewatch.spine.rotation_angle import angle_interval
from spinewatch.triads.pose import Pose


class ReferenceMissingError(SpinewatchError):
    """The reference triad was not measured in a stage, so that the two stages have no common frame."""

    code = "reference-missing"


@dataclass(frozen=True, eq=False)
class VertebraMotion:
    """Motion of one vertebra's triad, in the axes of the reference triad.

    Attributes
    ----------
    vertebra
        Label of the vertebra.
    translation_mm
        Displacement of the triad's P, shape (3,), mm.
    translation_sd_mm
        Its standard deviations, shape (3,), mm.
    rotation
        Rotation, shape (3, 3).
    rotation_vector_deg
        The same as a rotation vector, shape (3,), degrees.
    rotation_sd_deg
        Its standard deviations, shape (3,), degrees.
    angle_deg
        Angle of the rotation, degrees.
    angle_sd_deg
        Its standard deviation to first order, degrees. Without rotation the angle is the length of three errors: never
        negative, and 1.6 deviations on average where the errors are equal; its interval counts with that.
    angle_interval_deg
        Ends of its 95% interval, never negative, degrees.
    normal_angle_deg
        Angle between the two normals, degrees: the only part of a rotation that the thesis measures.
    normal_angle_sd_deg
        Its standard deviation to first order, degrees; without rotation the angle is the length of two errors.
    normal_angle_interval_deg
        Ends of its 95% interval, never negative, degrees.
    """

    vertebra: str
    translation_mm: Float
    translation_sd_mm: Float
    rotation: Float
    rotation_vector_deg: Float
    rotation_sd_deg: Float
    angle_deg: float
    angle_sd_deg: float
    angle_interval_deg: tuple[float, float]
    normal_angle_deg: float
    normal_angle_sd_deg: float
    normal_angle_interval_deg: tuple[float, float]


def relative_pose(pose: Pose, reference: Pose) -> Pose:
    """Return a pose in the frame of the reference triad, ``G = X_ref^-1 X``.

    Parameters
    ----------
    pose
        Pose of a triad, object space.
    reference
        Pose of the reference triad, object space.

    Returns
    -------
    Pose
        Pose in the axes of the reference; its covariance includes that of the reference.
    """
    to_reference = reference.rotation.T
    arm = pose.position_mm - reference.position_mm
    J = np.zeros((6, 12))
    J[:3, :3], J[3:, 3:6] = to_reference, to_reference
    J[:3, 6:9], J[3:, 9:] = -to_reference, -to_reference
    J[:3, 9:] = to_reference @ cross_matrix(arm) * np.radians(1.0)
    S = np.zeros((12, 12))
    S[:6, :6], S[6:, 6:] = pose.covariance, reference.covariance
    return Pose(to_reference @ arm, to_reference @ pose.rotation, J @ S @ J.T)


def relative_motion(
    start: Mapping[str, Pose], end: Mapping[str, Pose], reference: str
) -> tuple[VertebraMotion, ...]:
    """Return the motions of vertebrae from one stage to another, ``D = G_end G_start^-1``.

    Parameters
    ----------
    start, end
        Poses by vertebra in each stage, object space of that stage.
    reference
        Vertebra of the reference triad.

    Returns
    -------
    tuple of VertebraMotion
        Motions of the vertebrae that both stages have, without the reference, in the order of ``start``.

    Raises
    ------
    ReferenceMissingError
        If a stage has no pose of the reference.

    References
    ----------
    Replaces thesis eq. 6.1, which uses the normal alone (`spinewatch.thesis_1995.motion`). The translation is the
    displacement of P, where eq. 6.1 moves the vertebral body with an offset that is not rotated.

    Examples
    --------
    >>> import numpy as np
    >>> def at(x: float, R: np.ndarray) -> Pose:
    ...     return Pose(np.array([x, 0.0, 0.0]), R, np.zeros((6, 6)))
    >>> quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    >>> start = {"L1": at(0, np.eye(3)), "T9": at(100, np.eye(3))}
    >>> end = {"L1": at(0, np.eye(3)), "T9": at(90, quarter)}
    >>> (motion,) = relative_motion(start, end, "L1")
    >>> motion.translation_mm, motion.rotation_vector_deg.round(6)
    (array([-10.,   0.,   0.]), array([ 0.,  0., 90.]))
    """
    for stage, poses in (("start", start), ("end", end)):
        if reference not in poses:
            raise ReferenceMissingError(
                f"reference {reference} was not measured in the {stage} stage; take that stage again or use another"
                " reference"
            )
    return tuple(
        _motion(
            vertebra,
            relative_pose(start[vertebra], start[reference]),
            relative_pose(end[vertebra], end[reference]),
        )
        for vertebra in start
        if vertebra != reference and vertebra in end
    )


def _motion(vertebra: str, before: Pose, after: Pose) -> VertebraMotion:
    """Return the motion between two poses in the frame of the reference."""
    R = after.rotation @ before.rotation.T
    vector = vector_from_rotation(R)
    angle = float(np.linalg.norm(vector))
    rotation_covariance = after.covariance[3:, 3:] + R @ before.covariance[3:, 3:] @ R.T
    J = inverse_left_jacobian(vector)
    vector_covariance = J @ rotation_covariance @ J.T
    angle_variance = variance_about(vector, rotation_covariance)
    translation_covariance = before.covariance[:3, :3] + after.covariance[:3, :3]
    across = np.cross(before.normal, after.normal)
    # A rotation about the normal does not change it.
    tilt = np.eye(3) - np.outer(before.normal, before.normal)
    normal_covariance = tilt @ (before.covariance[3:, 3:] + after.covariance[3:, 3:]) @ tilt
    normal_variance = variance_about(across, normal_covariance)
    normal_angle = float(np.degrees(np.arctan2(np.linalg.norm(across), before.normal @ after.normal)))
    # A turned normal moves in the plane across it, which the other two axes of the triad span.
    plane = before.rotation[:, :2].T
    length = float(np.linalg.norm(across))
    axis = across / length if length > 0 else np.zeros(3)
    return VertebraMotion(
        vertebra=vertebra,
        translation_mm=after.position_mm - before.position_mm,
        translation_sd_mm=np.sqrt(np.diag(translation_covariance)),
        rotation=R,
        rotation_vector_deg=np.degrees(vector),
        rotation_sd_deg=np.sqrt(np.diag(vector_covariance)),
        angle_deg=float(np.degrees(angle)),
        angle_sd_deg=float(np.sqrt(angle_variance)),
        angle_interval_deg=angle_interval(np.degrees(vector), vector_covariance),
        normal_angle_deg=normal_angle,
        normal_angle_sd_deg=float(np.sqrt(normal_variance)),
        normal_angle_interval_deg=angle_interval(
            normal_angle * plane @ axis, plane @ normal_covariance @ plane.T
        ),
    )
