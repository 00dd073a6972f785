"""Motion of the vertebrae between two stages, computed from the stored poses at each request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

from fastapi import APIRouter, Query

from contract.base import StageName
from contract.motion import MissingMotion, Motion, StageFlag, StageReference, VertebraMotion
from service.dependencies import DatabaseDep, problems
from service.parameters import SurgeryId
from spinewatch.errors import SpinewatchError
from spinewatch.spine.motion import relative_motion
from spinewatch.triads.pose import Pose
from store import measurements, surgeries, tables

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/motion", tags=["motion"])


class SameStageError(SpinewatchError):
    """Motion was requested between a stage and itself."""

    code = "same-stage-twice"


@router.get("", responses=problems(404, 409, 422))
def get_motion(
    surgery_id: SurgeryId,
    database: DatabaseDep,
    start: Annotated[StageName, Query(alias="from", description="The earlier stage.")],
    end: Annotated[StageName, Query(alias="to", description="The later stage.")],
) -> Motion:
    """Get the motion of the vertebrae from one measured stage to another."""
    if start == end:
        raise SameStageError("from and to are the same stage; give two different ones")
    with database.read() as session:
        surgery = surgeries.get(session, surgery_id)
        measured = [measurements.get(session, surgery_id, name) for name in (start, end)]
        first, last = (stage for stage, _ in measured)
        before, after = (measurements.poses(session, stage.id) for stage in (first, last))
    motions = relative_motion(before, after, surgery.reference_vertebra)
    others = [name for name in surgery.vertebrae if name != surgery.reference_vertebra]
    return Motion(
        surgery_id=surgery_id,
        start=_reference(first),
        end=_reference(last),
        reference_vertebra=surgery.reference_vertebra,
        frame=f"reference triad {surgery.reference_vertebra}",
        vertebrae=[VertebraMotion.of(motion) for motion in motions],
        missing=_missing(others, {first.name: before, last.name: after}),
        flags=[
            StageFlag(stage=stage.name, **flag)
            for stage, result in measured
            for flag in result.result["flags"]
        ],
    )


def _reference(stage: tables.Stage) -> StageReference:
    return StageReference(name=stage.name, take=stage.take, calibration_id=stage.calibration_id)


def _missing(vertebrae: Sequence[str], poses: Mapping[str, Mapping[str, Pose]]) -> list[MissingMotion]:
    absent = {
        vertebra: [stage for stage, labelled in poses.items() if vertebra not in labelled]
        for vertebra in vertebrae
    }
    return [
        MissingMotion(
            vertebra=vertebra, reason=f"no triad with a pose is labelled {vertebra} in {' and '.join(names)}"
        )
        for vertebra, names in absent.items()
        if names
    ]
