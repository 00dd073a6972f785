"""Motion of the vertebrae between two stages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import ConfigDict, Field

from contract.base import Identifier, Matrix3, Number, Schema, StageName, Vector3, Vertebra

if TYPE_CHECKING:
    import spinewatch.spine.motion


class StageReference(Schema):
    """The take of a stage that a result was derived from."""

    name: StageName
    take: int
    calibration_id: Identifier


class VertebraMotion(Schema):
    """Motion of one vertebra, in the axes of the reference triad."""

    vertebra: Vertebra
    translation_mm: Annotated[Vector3, Field(description="Displacement of the triad's point P, mm.")]
    translation_sd_mm: Annotated[Vector3, Field(description="Standard deviations of the displacement, mm.")]
    rotation: Annotated[Matrix3, Field(description="Rotation matrix from the first stage to the second.")]
    rotation_vector_deg: Annotated[Vector3, Field(description="The same as axis times angle, degrees.")]
    rotation_sd_deg: Annotated[
        Vector3, Field(description="Standard deviations of the rotation vector, degrees.")
    ]
    angle_deg: Annotated[Number, Field(description="Angle of the rotation, degrees.")]
    angle_sd_deg: Annotated[Number, Field(description="Standard deviation of the angle, degrees.")]
    normal_angle_deg: Annotated[Number, Field(description="Angle between the triad's normals, degrees.")]

    @classmethod
    def of(cls, motion: spinewatch.spine.motion.VertebraMotion) -> VertebraMotion:
        """Return the contract model of the library's motion."""
        return cls.model_validate(motion)


class MissingMotion(Schema):
    """A vertebra without a motion."""

    vertebra: Vertebra
    reason: str


class Motion(Schema):
    """Motion of every vertebra that was measured in both stages, relative to the reference vertebra."""

    model_config = ConfigDict(validate_by_name=True)

    surgery_id: Identifier
    start: Annotated[StageReference, Field(alias="from")]
    end: Annotated[StageReference, Field(alias="to")]
    reference_vertebra: Vertebra
    frame: Annotated[str, Field(examples=["reference triad L1"])]
    vertebrae: list[VertebraMotion]
    missing: Annotated[list[MissingMotion], Field(description="Marked vertebrae without a motion.")]
