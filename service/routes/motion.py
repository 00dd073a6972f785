"""Motion of the vertebrae between two stages, derived from the stored poses whenever it is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import ConfigDict, Field

from contract.base import Identifier, Matrix3, Schema, StageName, Vector3, Vertebra
from service.dependencies import TheDatabase, problems
from spinewatch.errors import SpinewatchError
from spinewatch.spine.motion import VertebraMotion, relative_motion
from spinewatch.triads.pose import Pose
from store import stages, surgeries

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/motion", tags=["motion"])


class SameStageError(SpinewatchError):
    """Motion was asked for between a stage and itself."""

    code = "same-stage-twice"


class StageReference(Schema):
    """The take of a stage that a result was derived from."""

    name: StageName
    take: int
    calibration_id: Identifier


class VertebraMotionDocument(Schema):
    """How one vertebra moved, in the axes of the reference triad."""

    vertebra: Vertebra
    translation_mm: Annotated[Vector3, Field(description="Displacement of the triad's point P, mm.")]
    translation_sd_mm: Annotated[Vector3, Field(description="Standard deviations, mm.")]
    rotation: Annotated[Matrix3, Field(description="Rotation from the first stage to the second.")]
    rotation_vector_deg: Annotated[Vector3, Field(description="The same as axis times angle, degrees.")]
    rotation_sd_deg: Annotated[Vector3, Field(description="Standard deviations of it, degrees.")]
    angle_deg: Annotated[float, Field(description="Angle of the rotation, degrees.")]
    angle_sd_deg: Annotated[float, Field(description="Its standard deviation, degrees.")]
    normal_angle_deg: Annotated[float, Field(description="Angle between the triad's normals, degrees.")]

    @classmethod
    def of(cls, motion: VertebraMotion) -> VertebraMotionDocument:
        """Return the document of a motion."""
        return cls(
            vertebra=motion.vertebra,
            translation_mm=motion.translation_mm.tolist(),
            translation_sd_mm=motion.translation_sd_mm.tolist(),
            rotation=motion.rotation.tolist(),
            rotation_vector_deg=motion.rotation_vector_deg.tolist(),
            rotation_sd_deg=motion.rotation_sd_deg.tolist(),
            angle_deg=motion.angle_deg,
            angle_sd_deg=motion.angle_sd_deg,
            normal_angle_deg=motion.normal_angle_deg,
        )


class MissingDocument(Schema):
    """A vertebra without a motion."""

    vertebra: Vertebra
    reason: str


class MotionDocument(Schema):
    """Motion of every vertebra that was measured in both stages, relative to the reference vertebra."""

    model_config = ConfigDict(validate_by_name=True)

    surgery_id: Identifier
    start: Annotated[StageReference, Field(alias="from")]
    end: Annotated[StageReference, Field(alias="to")]
    reference_vertebra: Vertebra
    frame: Annotated[str, Field(examples=["reference triad L1"])]
    vertebrae: list[VertebraMotionDocument]
    missing: Annotated[list[MissingDocument], Field(description="Marked vertebrae without a motion.")]


@router.get("", responses=problems(404, 409, 422))
def get_motion(
    surgery_id: str,
    record: TheDatabase,
    start: Annotated[StageName, Query(alias="from", description="The earlier stage.")],
    end: Annotated[StageName, Query(alias="to", description="The later stage.")],
) -> MotionDocument:
    """Show how the vertebrae moved from one measured stage to another."""
    if start == end:
        raise SameStageError("from and to are the same stage; ask for two different ones")
    with record.reading() as session:
        surgery = surgeries.get(session, surgery_id)
        first, first_measured = stages.measurement(session, surgery_id, start)
        last, last_measured = stages.measurement(session, surgery_id, end)
    before, after = stages.poses(first_measured), stages.poses(last_measured)
    motions = relative_motion(before, after, surgery.reference_vertebra)
    others = [name for name in surgery.vertebrae if name != surgery.reference_vertebra]
    return MotionDocument(
        surgery_id=surgery_id,
        start=StageReference(name=first.name, take=first.take, calibration_id=first.calibration_id),
        end=StageReference(name=last.name, take=last.take, calibration_id=last.calibration_id),
        reference_vertebra=surgery.reference_vertebra,
        frame=f"reference triad {surgery.reference_vertebra}",
        vertebrae=[VertebraMotionDocument.of(motion) for motion in motions],
        missing=_missing(others, {first.name: before, last.name: after}),
    )


def _missing(vertebrae: Sequence[str], poses: Mapping[str, Mapping[str, Pose]]) -> list[MissingDocument]:
    absent = {
        vertebra: [stage for stage, labelled in poses.items() if vertebra not in labelled]
        for vertebra in vertebrae
    }
    return [
        MissingDocument(
            vertebra=vertebra, reason=f"no triad with a pose is labelled {vertebra} in {' and '.join(names)}"
        )
        for vertebra, names in absent.items()
        if names
    ]
