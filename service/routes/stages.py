"""Stages: submitting stereo pairs, revisions, lists, and the images."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Depends, Form, Query, Response
from sqlalchemy.orm import Session

from contract.base import Identifier, StageName
from contract.page import Listing
from contract.revision import NewRevision, Remeasurement, TriadEdits
from contract.stage import Stage
from service.dependencies import (
    ACCEPTED,
    ActorDep,
    ClockToleranceDep,
    DatabaseDep,
    QueueDep,
    enqueue,
    json_body,
    multipart_body,
    problems,
)
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.forms.stage import StageForm, read_stage, require_calibrated_sizes
from service.idempotency import OnceDep
from service.images import FILE_RESPONSES, SidePath, file_response
from service.paging import CreatedDep, Paging, PartDep, StateFilter
from service.parameters import PairQuery, StagePath, SurgeryId, TakeQuery
from service.problems import InvalidInputError
from service.revision_checks import EditedPair, check_centres, check_edits, check_parameters
from service.stage_documents import stage_document
from service.turns import WriteTurn
from store import calibrations, measurements, pair_results, stage_submission, stages, surgeries, tables
from store.clock import utc_now
from store.errors import NotFoundError
from store.page import Position

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/stages", tags=["stages"])

_SAME_PAIR: dict[int | str, dict[str, Any]] = {
    200: {
        "model": Stage,
        "description": "The same pair was submitted under this name before: the stage that is there.",
        "headers": {"Location": {"description": "Path of the stage.", "schema": {"type": "string"}}},
    }
}


@router.post(
    "",
    status_code=202,
    dependencies=[Depends(multipart_body), WriteTurn],
    responses={**ACCEPTED, **_SAME_PAIR, **problems(400, 404, 409, 413, 415, 422)},
    response_model=Stage,
)
def submit_stage(
    surgery_id: SurgeryId,
    form: Annotated[StageForm, Form(media_type="multipart/form-data")],
    once: OnceDep,
    queue: QueueDep,
    actor: ActorDep,
    tolerance: ClockToleranceDep,
) -> Response:
    """Submit a stereo pair, or a burst of 2 to 60 pairs, for measurement.

    Either everything is stored or nothing. The same pair with the same calibration and times under the same name is
    answered with the stage that is there; times may be left out. Any other pair under a name in use is rejected,
    unless the latest job of that name failed or was cancelled, or it has succeeded and `retake` is true: the pair is
    then its next take. The parts left and right are repeated for a burst; its poses are means over the pairs.
    """
    now = utc_now()
    new = read_stage(form, now, tolerance)
    with once.write() as session:
        surgery = surgeries.get(session, surgery_id)
        try:
            calibration = calibrations.get(session, form.calibration_id)
        except NotFoundError as error:
            raise InvalidInputError("calibration_id", error) from error
        require_calibrated_sizes(new, calibration)
        same = stage_submission.find_same(session, surgery, calibration, new)
        if same is not None:
            return once.answer(
                stage_document(same), 200, Location=f"/v1/surgeries/{surgery_id}/stages/{same.name}"
            )
        stage = stage_submission.submit(session, surgery, calibration, new, now, actor, retake=form.retake)
        session.flush()
        answer = once.answer(stage_document(stage), 202, Location=f"/v1/jobs/{stage.job.id}")
    enqueue(queue, stage.job.id)
    return answer


@router.post(
    "/{name}/revisions",
    status_code=202,
    dependencies=[Depends(json_body), WriteTurn],
    responses={**ACCEPTED, **problems(404, 409, 413, 415, 422)},
    response_model=Stage,
)
def revise_stage(
    surgery_id: SurgeryId,
    name: StagePath,
    changes: Annotated[NewRevision, Body()],
    once: OnceDep,
    queue: QueueDep,
    actor: ActorDep,
) -> Response:
    """Revise the take whose results count: edit its labels, triads and ball centres, or measure its images again.

    The revision is a take with the same images. It counts once its job has succeeded; the revised take is kept. After
    edits of ball centres points, triads, labels and poses are computed again from the edited features.
    """
    with once.write() as session:
        surgery = surgeries.get(session, surgery_id)
        stage = stage_submission.revise(session, surgery_id, name, changes, utc_now(), actor)
        revised, measured = measurements.get(session, surgery_id, name)
        if isinstance(changes, TriadEdits):
            check_edits(changes, measurements.triads(session, revised.id), surgery.vertebrae)
            check_centres(changes.centres, _edited_pairs(session, changes, revised, measured))
        elif isinstance(changes, Remeasurement):
            own = measurements.own_parameters(session, revised)
            check_parameters(changes, measured.result["parameters"], own)
        session.flush()
        answer = once.answer(stage_document(stage), 202, Location=f"/v1/jobs/{stage.job.id}")
    enqueue(queue, stage.job.id)
    return answer


@router.get("", responses={**NOT_MODIFIED, **problems(404, 422)}, response_model=Listing[Stage])
def list_stages(
    surgery_id: SurgeryId,
    database: DatabaseDep,
    part: PartDep,
    created: CreatedDep,
    sort: Annotated[
        Literal["-created_at", "created_at", "name", "-name"],
        Query(description="Order: by age, newest first with the minus sign, or by name."),
    ] = "-created_at",
    name: Annotated[StageName | None, Query(description="Only takes of the stage of this name.")] = None,
    state: StateFilter = None,
    calibration_id: Annotated[
        Identifier | None, Query(description="Only takes of the cameras of this calibration.")
    ] = None,
) -> Response:
    """List all takes of the stages of a surgery, newest first."""
    filters: dict[str, Any] = {
        "name": name,
        "state": state,
        "calibration_id": calibration_id,
        **created,
    }
    paging = Paging(part.limit, sort, part.cursor, surgery_id=surgery_id, **filters)
    with database.read() as session:
        surgeries.get(session, surgery_id)
        page = stages.listed(session, surgery_id, paging.wanted, **filters)
    items = [stage_document(row) for row in page.items]
    return document_response(Listing[Stage].model_validate(paging.document(page, items)), part.if_none_match)


@router.get("/{name}", responses={**NOT_MODIFIED, **problems(404)}, response_model=Stage)
def get_stage(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    take: Annotated[
        int | None, Query(ge=1, le=2**31 - 1, description="Number of the take; by default the latest.")
    ] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the latest take of a stage, or another one."""
    with database.read() as session:
        return document_response(stage_document(stages.get(session, surgery_id, name, take)), if_none_match)


@router.get("/{name}/takes", responses={**NOT_MODIFIED, **problems(404, 422)}, response_model=Listing[Stage])
def list_takes(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    part: PartDep,
) -> Response:
    """List the takes of a stage, revisions among them, latest first."""
    paging = Paging(part.limit, "-take", part.cursor, surgery_id=surgery_id, name=name)
    with database.read() as session:
        rows = stages.takes(session, surgery_id, name)
    page = paging.page_of(rows, lambda row: Position(str(row.take), row.id))
    items = [stage_document(row) for row in page.items]
    return document_response(Listing[Stage].model_validate(paging.document(page, items)), part.if_none_match)


@router.get(
    "/{name}/images/{side}",
    response_class=Response,
    responses=FILE_RESPONSES,
)
def get_image(
    surgery_id: SurgeryId,
    name: StagePath,
    side: SidePath,
    database: DatabaseDep,
    pair: PairQuery = 1,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the image file, without the metadata that it came with; its ETag is the SHA-256 of what is stored."""
    with database.read() as session:
        stage = stages.measured(session, surgery_id, name, take)
        row = stages.image(session, stage, pair, side)
    return file_response(database, row, if_none_match)


def _edited_pairs(
    session: Session,
    edits: TriadEdits,
    revised: tables.stages.Stage,
    measured: tables.measurements.Measurement,
) -> dict[int, EditedPair | None]:
    """Return the pairs that edits of ball centres name; None for one that the stage has not."""
    found: dict[int, EditedPair | None] = {}
    for pair in sorted({edit.pair for edit in edits.centres}):
        if pair > revised.pair_count:
            found[pair] = None
            continue
        stored = pair_results.features(session, revised, measured, pair)
        found[pair] = EditedPair(
            features=None if stored is None else stored.features,
            sizes={
                side: (image.width, image.height)
                for side in ("left", "right")
                for image in [stages.image(session, revised, pair, side)]
            },
        )
    return found
