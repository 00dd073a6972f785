"""Motion of the vertebrae between two stages, computed from the stored poses at each request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated

from fastapi import APIRouter, Query, Response

from contract.base import StageName
from contract.library_setup import SurgeryLevels, library_setup, marked_poses
from contract.motion import BodyMotion, MissingMotion, Motion, StageFlag, VertebraMotion
from contract.spine import VertebraChange, spine_frame
from contract.stage_reference import StageReference
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.parameters import SurgeryId
from spinewatch.errors import SpinewatchError
from spinewatch.spine.body_motion import body_motion
from spinewatch.spine.configuration import InitialKind
from spinewatch.spine.motion import relative_motion
from spinewatch.spine.stage_order import require_baseline
from spinewatch.triads.pose import Pose
from store import measurements, spines, surgeries, tables
from store.spines import SpineWork

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/motion", tags=["motion"])


class SameStageError(SpinewatchError):
    """Motion was requested between a stage and itself."""

    code = "same-stage-twice"


@router.get("", responses={**NOT_MODIFIED, **problems(404, 409, 422)}, response_model=Motion)
def get_motion(
    surgery_id: SurgeryId,
    database: DatabaseDep,
    start: Annotated[StageName, Query(alias="from", description="The earlier stage.")],
    end: Annotated[StageName, Query(alias="to", description="The later stage.")],
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the motion of the vertebrae from one measured stage to another.

    Of the triads always; with a setup of the spine also of the vertebral bodies, in patient axes.
    """
    if start == end:
        raise SameStageError("from and to are the same stage; give two different ones")
    with database.read() as session:
        surgery = surgeries.get(session, surgery_id)
        measured = [measurements.get(session, surgery_id, name) for name in (start, end)]
        first, last = (stage for stage, _ in measured)
        before, after = (measurements.poses(session, stage.id) for stage in (first, last))
        work = spines.work(session, surgery_id)
    motions = relative_motion(before, after, surgery.reference_vertebra)
    others = [name for name in surgery.vertebrae if name != surgery.reference_vertebra]
    bodies, reason = _bodies(work, start, end)
    motion = Motion(
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
        bodies=bodies,
        bodies_reason=reason,
    )
    return document_response(motion, if_none_match)


def _bodies(work: SpineWork, start: str, end: str) -> tuple[BodyMotion | None, str | None]:
    """Return the motion of the vertebral bodies with a marker in both stages, or the reason why there is none."""
    if work.setup is None:
        return None, "the surgery has no setup of the spine"
    document = work.setup.setup
    reference = document.reference_vertebra or work.reference_vertebra
    baseline = work.plans[0].baseline
    stages = {name: marked_poses(document, poses) for name, poses in work.poses.items()}
    measured = {plan.reference.name for plan in work.plans}
    try:
        require_baseline(baseline, reference, stages[baseline] if baseline in measured else None)
        levels = SurgeryLevels(work.reference_vertebra, work.extra_levels)
        rebaselines = work.setup.rebaselines
        setup, _ = library_setup(document, rebaselines, levels, baseline, stages[baseline], work.radiographs)
        changes = body_motion(setup, stages, start, end)
    except SpinewatchError as error:
        return None, str(error)
    return BodyMotion(
        setup_revision=work.setup.revision,
        frame=spine_frame(baseline, reference),
        assumed=setup.initial.kind is InitialKind.GENERIC,
        vertebrae=[VertebraChange.of(change) for change in changes],
    ), None


def _reference(stage: tables.stages.Stage) -> StageReference:
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
