"""Stages: submitting stereo pairs, and their images and results."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Depends, Form, Query, Response

from contract.base import Identifier, StageName
from contract.burst import LabelSource, StageBurst
from contract.flag import Flag
from contract.page import Listing
from contract.revision import NewRevision, Revision, TriadEdits
from contract.stage import CountPair, Stage, StageFeatures, StageTriads
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
from service.images import FILE_RESPONSES, SidePath, file_response, image_pair
from service.paging import CreatedDep, Paging, PartDep, StateFilter
from service.parameters import StagePath, SurgeryId
from service.problems import InvalidInputError
from service.revision_checks import check_edits, check_parameters
from service.routes.jobs import job_of
from store import calibrations, measurements, stages, surgeries, tables
from store.clock import utc_now
from store.errors import NotFoundError
from store.page import Position, page_of_items

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/stages", tags=["stages"])

_SAME_PAIR: dict[int | str, dict[str, Any]] = {
    200: {
        "model": Stage,
        "description": "The same pair was submitted under this name before: the stage that is there.",
        "headers": {"Location": {"description": "Path of the stage.", "schema": {"type": "string"}}},
    }
}


TakeQuery = Annotated[
    int | None,
    Query(ge=1, le=2**31 - 1, description="Number of the take; by default the latest one that was measured."),
]


@router.post(
    "",
    status_code=202,
    dependencies=[Depends(multipart_body)],
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

    Either everything is stored or nothing. The same pair with the same calibration under the same name is answered
    with the stage that is there. Any other pair under a name in use is rejected, unless the latest job of that name
    failed or was cancelled, or it has succeeded and `retake` is true: the pair is then its next take. The parts left
    and right are repeated for a burst; its poses are means over the pairs.
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
        same = stages.find_same(session, surgery, calibration, new)
        if same is not None:
            return once.answer(_stage(same), 200, Location=f"/v1/surgeries/{surgery_id}/stages/{same.name}")
        stage = stages.submit(session, surgery, calibration, new, now, actor, retake=form.retake)
        session.flush()
        answer = once.answer(_stage(stage), 202, Location=f"/v1/jobs/{stage.job.id}")
    enqueue(queue, stage.job.id)
    return answer


@router.post(
    "/{name}/revisions",
    status_code=202,
    dependencies=[Depends(json_body)],
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
    """Revise the take whose results count: edit its labels and triads, or measure its images again.

    The revision is a take with the same images. It counts once its job has succeeded; the revised take is kept.
    """
    with once.write() as session:
        surgery = surgeries.get(session, surgery_id)
        stage = stages.revise(session, surgery_id, name, changes, utc_now(), actor)
        revised, measured = measurements.get(session, surgery_id, name)
        if isinstance(changes, TriadEdits):
            triads = measurements.triads(session, revised.id)
            check_edits(changes, triads, surgery.vertebrae, is_burst=bool(revised.further_pairs))
        else:
            check_parameters(changes, measured.result["parameters"])
        session.flush()
        answer = once.answer(_stage(stage), 202, Location=f"/v1/jobs/{stage.job.id}")
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
    items = [_stage(row) for row in page.items]
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
        return document_response(_stage(stages.get(session, surgery_id, name, take)), if_none_match)


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
    page = page_of_items(rows, lambda row: Position(str(row.take), row.id), paging.wanted)
    items = [_stage(row) for row in page.items]
    return document_response(Listing[Stage].model_validate(paging.document(page, items)), part.if_none_match)


@router.get("/{name}/triads", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageTriads)
def get_triads(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the triads of a measured stage in label order; those without a label come last."""
    with database.read() as session:
        stage, measured = measurements.get(session, surgery_id, name, take)
        triads = measurements.triads(session, stage.id)
    result = measured.result
    document = StageTriads(
        surgery_id=surgery_id,
        stage=stage.name,
        take=stage.take,
        frame=f"object space of calibration {stage.calibration.name}",
        triads=triads,
        flags=[Flag(**flag) for flag in result["flags"]],
        parameters=result["parameters"],
        templates=result["templates"],
        version=result["version"],
        labelled_by=_label_source(result),
        revision=_revision(stage),
    )
    return document_response(document, if_none_match)


@router.get("/{name}/burst", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageBurst)
def get_burst(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the poses in each pair of a burst, and the breathing in it; null for a stage of a single pair."""
    with database.read() as session:
        stage, _ = measurements.get(session, surgery_id, name, take)
        burst = measurements.burst(session, stage.id)
    return document_response(StageBurst(stage=stage.name, take=stage.take, burst=burst), if_none_match)


@router.get(
    "/{name}/features", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageFeatures
)
def get_features(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the possible ball centres of a measured stage, best score first."""
    with database.read() as session:
        stage, measured = measurements.get(session, surgery_id, name, take)
        features = measurements.features(session, stage.id)
    document = StageFeatures.model_validate(
        {
            "surgery_id": surgery_id,
            "stage": stage.name,
            "take": stage.take,
            "fields": measured.result["fields"],
            "exposure": measured.result["exposure"],
            "features": features,
        }
    )
    return document_response(document, if_none_match)


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
    pair: Annotated[int, Query(ge=1, description="Number of the pair in a burst.")] = 1,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the original image file; its ETag is its SHA-256."""
    with database.read() as session:
        stage = stages.measured(session, surgery_id, name, take)
        return file_response(session, stages.image(session, stage, pair, side), if_none_match)


def _stage(row: tables.Stage) -> Stage:
    """Return the model of a row with its images, job and measurement."""
    measured = row.measurement
    counts = {} if measured is None else {features.side: features.count for features in measured.features}
    return Stage(
        id=row.id,
        surgery_id=row.surgery_id,
        name=row.name,
        take=row.take,
        calibration_id=row.calibration_id,
        captured_at=row.captured_at,
        left_exposed_at=row.left_exposed_at,
        right_exposed_at=row.right_exposed_at,
        created_at=row.created_at,
        images=image_pair(row.left, row.right),
        pairs=1 + len(row.further_pairs),
        state=row.job.state,
        job=job_of(row.job, row),
        features=CountPair(**counts) if counts else None,
        triads=None if measured is None else measured.triad_count,
        flags=None if measured is None else [Flag(**flag) for flag in measured.result["flags"]],
        version=None if measured is None else measured.result["version"],
        labelled_by=None if measured is None else _label_source(measured.result),
        revision=_revision(row),
    )


def _revision(row: tables.Stage) -> Revision | None:
    """Return what a take changes of an earlier one, None for a take with images of its own."""
    if row.revised_take is None:
        return None
    return Revision.model_validate(
        {"of_take": row.revised_take, "changes": row.changes, "by": row.revised_by, "at": row.revised_at}
    )


def _label_source(result: tables.Document) -> LabelSource | None:
    """Return what decided on the labels of a result; results of earlier versions have none."""
    source = result.get("labelled_by")
    return None if source is None else LabelSource.model_validate(source)
