"""Motion of vertebrae between two stages, relative to the reference triad; NumPy only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import SpinewatchError
from spinewatch.geometry.rotations import cross_matrix, inverse_left_jacobian, vector_from_rotation
from spinewatch.triads.pose import Pose


class ReferenceMissingError(SpinewatchError):
    """The reference triad was not measured in a stage, so that there is no frame to compare stages in."""

    code = "reference-missing"


@dataclass(frozen=True, eq=False)
class VertebraMotion:
    """How one vertebra's triad moved, in the axes of the reference triad (clinical.md).

    ``translation_mm`` (3,) of the triad's P with ``translation_sd_mm`` (3,); ``rotation`` (3, 3) and the same
    as ``rotation_vector_deg`` (3,) with ``rotation_sd_deg`` (3,); ``angle_deg`` its length with
    ``angle_sd_deg``; ``normal_angle_deg`` the angle between the two normals, all that the thesis sees of a
    rotation.
    """

    vertebra: str
    translation_mm: Float
    translation_sd_mm: Float
    rotation: Float
    rotation_vector_deg: Float
    rotation_sd_deg: Float
    angle_deg: float
    angle_sd_deg: float
    normal_angle_deg: float


def relative_pose(pose: Pose, reference: Pose) -> Pose:
    """Return a pose in the frame of the reference triad, G = X_ref^-1 X.

    Its covariance, about the reference's axes, includes the reference's own.
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
    """Return the motions from one stage to another of every vertebra measured in both, in ``start``'s order.

    Motion is D = G_end G_start^-1 in the frame of the reference triad, which is not listed itself; the
    translation is the displacement of P. Raises ``ReferenceMissingError``. Replaces eq. 6.1, which knows the
    normal alone (``legacy_1995``).
    """
    for stage, poses in (("start", start), ("end", end)):
        if reference not in poses:
            raise ReferenceMissingError(
                f"reference {reference} was not measured in the {stage} stage; capture it again"
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
    R = after.rotation @ before.rotation.T
    vector = vector_from_rotation(R)
    angle = float(np.linalg.norm(vector))
    turning = after.covariance[3:, 3:] + R @ before.covariance[3:, 3:] @ R.T
    J = inverse_left_jacobian(vector)
    if angle > 0:
        unit = vector / angle
        angle_variance = float(unit @ turning @ unit)
    else:  # no axis yet: the worst one
        angle_variance = float(np.linalg.eigvalsh(turning)[-1])
    moving = before.covariance[:3, :3] + after.covariance[:3, :3]
    n = np.stack([before.normal, after.normal])
    return VertebraMotion(
        vertebra=vertebra,
        translation_mm=after.position_mm - before.position_mm,
        translation_sd_mm=np.sqrt(np.diag(moving)),
        rotation=R,
        rotation_vector_deg=np.degrees(vector),
        rotation_sd_deg=np.sqrt(np.diag(J @ turning @ J.T)),
        angle_deg=float(np.degrees(angle)),
        angle_sd_deg=float(np.sqrt(angle_variance)),
        normal_angle_deg=float(np.degrees(np.arctan2(np.linalg.norm(np.cross(*n)), n[0] @ n[1]))),
    )
