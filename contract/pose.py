"""The pose of a rigid body in object space: the one spelling of its fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from contract.base import Matrix3, Matrix6, Schema, Vector3

if TYPE_CHECKING:
    import spinewatch.triads.pose


class PoseFields(Schema):
    """A pose with its uncertainty; all fields are null and ``reason`` is given when there is no pose."""

    reason: Annotated[str | None, Field(description="Why there is no pose.")]
    position_mm: Annotated[Vector3 | None, Field(description="P, the point where the legs meet, mm.")]
    position_sd_mm: Annotated[
        Vector3 | None, Field(description="Standard deviations of the position along X, Y and Z, mm.")
    ]
    normal: Annotated[Vector3 | None, Field(description="Unit normal.")]
    angles_deg: Annotated[Vector3 | None, Field(description="Angles of the normal with X, Y and Z, degrees.")]
    rotation: Annotated[
        Matrix3 | None, Field(description="Rotation matrix; its columns are the body's axes.")
    ]
    rotation_sd_deg: Annotated[
        Vector3 | None,
        Field(description="Standard deviations about the body's own x, y and z axes, degrees."),
    ]
    covariance: Annotated[
        Matrix6 | None,
        Field(
            description="Covariance of the position (mm) and of a rotation vector about the object axes (degrees)."
        ),
    ]

    def pose(self) -> spinewatch.triads.pose.Pose | None:
        """Return the library's pose, None when there is none."""
        from spinewatch.triads.pose import Pose  # noqa: PLC0415 - only who computes with poses needs it

        if self.position_mm is None:
            return None
        return Pose(np.array(self.position_mm), np.array(self.rotation), np.array(self.covariance))


class FrameTransform(Schema):
    """The rigid transform ``x -> R x + t`` from one coordinate system to another."""

    rotation: Annotated[Matrix3, Field(description="R, the rotation matrix.")]
    translation_mm: Annotated[Vector3, Field(description="t, mm.")]


def pose_fields(pose: spinewatch.triads.pose.Pose | None, reason: str | None) -> dict[str, Any]:
    """Return the values of the fields of a ``PoseFields``, null without a pose."""
    names = PoseFields.model_fields.keys() - {"reason"}
    return {"reason": reason, **{name: None if pose is None else getattr(pose, name) for name in names}}


def pose_model(pose: spinewatch.triads.pose.Pose) -> PoseFields:
    """Return the contract model of a pose."""
    return PoseFields(**pose_fields(pose, None))
