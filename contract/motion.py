"""Motion of the vertebrae between two stages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import ConfigDict, Field

from contract.base import Identifier, Matrix3, Number, Schema, StageName, Vector2, Vector3, Vertebra
from contract.flag import Flag
from contract.spine import VertebraChange
from contract.stage_reference import StageReference

if TYPE_CHECKING:
    import spinewatch.spine.motion


class VertebraMotion(Schema):
    """Motion of one vertebra, in the axes of the reference triad."""

    vertebra: Annotated[Vertebra, Field(description="Name of the vertebra.")]
    translation_mm: Annotated[Vector3, Field(description="Displacement of the triad's point P, mm.")]
    translation_sd_mm: Annotated[Vector3, Field(description="Standard deviations of the displacement, mm.")]
    rotation: Annotated[Matrix3, Field(description="Rotation matrix from the first stage to the second.")]
    rotation_vector_deg: Annotated[Vector3, Field(description="The same as axis times angle, degrees.")]
    rotation_sd_deg: Annotated[
        Vector3, Field(description="Standard deviations of the rotation vector, degrees.")
    ]
    angle_deg: Annotated[Number, Field(description="Angle of the rotation, degrees.")]
    angle_sd_deg: Annotated[
        Number,
        Field(
            description="Standard deviation of the angle, degrees; to first order, too small for angles below it."
        ),
    ]
    angle_interval_deg: Annotated[
        Vector2 | None,
        Field(
            description="Ends of the 95% interval of the angle, degrees; never negative. Null in results of earlier"
            " versions.",
        ),
    ] = None
    normal_angle_deg: Annotated[Number, Field(description="Angle between the triad's normals, degrees.")]
    normal_angle_sd_deg: Annotated[
        Number,
        Field(description="Standard deviation of the angle between the normals, degrees; to first order."),
    ]
    normal_angle_interval_deg: Annotated[
        Vector2 | None,
        Field(
            description="Ends of the 95% interval of the angle between the normals, degrees; never negative. Null in"
            " results of earlier versions.",
        ),
    ] = None

    @classmethod
    def of(cls, motion: spinewatch.spine.motion.VertebraMotion) -> VertebraMotion:
        """Return the contract model of the library's motion."""
        return cls.model_validate(motion)


class StageFlag(Flag):
    """A flag of one of the two stages."""

    stage: StageName


class MissingMotion(Schema):
    """A vertebra without a motion."""

    vertebra: Annotated[Vertebra, Field(description="Name of the vertebra.")]
    reason: Annotated[str, Field(description="Why it has no motion.")]


class BodyMotion(Schema):
    """Motion of the bodies of the vertebrae with a marker, in patient axes."""

    setup_revision: Annotated[int, Field(description="Revision of the setup that it was computed with.")]
    frame: Annotated[
        str,
        Field(
            description="Name of the coordinate system.",
            examples=["patient axes at stage PRE, fixed to L1; origin at its centroid at PRE"],
        ),
    ]
    assumed: Annotated[bool, Field(description="Whether the initial configuration is a generic spine.")]
    vertebrae: Annotated[list[VertebraChange], Field(description="Motion of each vertebra, cranial first.")]


class Motion(Schema):
    """Motion of every vertebra that was measured in both stages, relative to the reference vertebra."""

    model_config = ConfigDict(validate_by_name=True)

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    start: Annotated[StageReference, Field(alias="from", description="The earlier stage.")]
    end: Annotated[StageReference, Field(alias="to", description="The later stage.")]
    reference_vertebra: Annotated[Vertebra, Field(description="The vertebra in whose frame motion is given.")]
    frame: Annotated[
        str, Field(description="Name of the coordinate system.", examples=["reference triad L1"])
    ]
    vertebrae: Annotated[
        list[VertebraMotion], Field(description="Motion of each vertebra but the reference.")
    ]
    missing: Annotated[list[MissingMotion], Field(description="Marked vertebrae without a motion.")]
    flags: Annotated[
        list[StageFlag], Field(description="Flags of both stages, those of the first stage first.")
    ]
    bodies: Annotated[
        BodyMotion | None,
        Field(description="Motion of the vertebral bodies; null without a setup of the spine."),
    ] = None
    bodies_reason: Annotated[
        str | None, Field(description="Why there is no motion of the bodies; null when there is.")
    ] = None
