"""The spine of a surgery: its setup, markers that were clamped again, and the spine of each stage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Depends, Query, Request, Response
from sqlalchemy.orm import Session

from contract.event import Actor
from contract.job import Job
from contract.page import Listing
from contract.setup_checks import check_rebaseline, check_setup
from contract.spine import StageSpine
from contract.spine_setup import (
    NewRebaseline,
    SetupRevision,
    SpineSetup,
    StoredRebaseline,
    StoredSpineSetup,
)
from service.dependencies import (
    ACCEPTED,
    ActorDep,
    DatabaseDep,
    QueueDep,
    csv_body,
    enqueue,
    json_body,
    problems,
)
from service.etags import NOT_MODIFIED, IfMatch, IfNoneMatch, document_response, require_match
from service.forms.spine_csv import parse_poses
from service.idempotency import OnceDep
from service.paging import Paging, PartDep
from service.parameters import StagePath, SurgeryId
from service.routes.jobs import job_of
from service.turns import WriteTurn
from store import jobs, spine_jobs, spine_setups, spines
from store.clock import utc_now
from store.database import Database
from store.page import Position
from store.queue import JobQueue

router = APIRouter(prefix="/v1/surgeries/{surgery_id}", tags=["spine"])

_CSV: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "text/csv": {
                "schema": {"type": "string"},
                "example": "vertebra,x_mm,y_mm,z_mm,coronal_deg,sagittal_deg,axial_deg\nT7,0,0,180,12.5,20,4\n",
            }
        },
    }
}
_JOB: dict[int | str, dict[str, Any]] = {
    200: {
        "headers": {
            "Location": {
                "description": "Path of the job that computes the spines; absent when none is added.",
                "schema": {"type": "string"},
            }
        }
    }
}


@router.put(
    "/spine",
    dependencies=[Depends(json_body), WriteTurn],
    responses={**_JOB, **problems(404, 412, 413, 415, 422, 428)},
    response_model=StoredSpineSetup,
)
def put_spine_setup(
    surgery_id: SurgeryId,
    setup: SpineSetup,
    database: DatabaseDep,
    queue: QueueDep,
    actor: ActorDep,
    if_match: IfMatch = None,
) -> Response:
    """Store what must be known of a surgery to interpret its triads as a spine; the spines are then computed again.

    A setup that differs from the latest one is a new revision; earlier ones are kept. To replace one, `If-Match` must
    name it by its ETag; the same setup again is no change.
    """
    return _store(surgery_id, lambda _: setup, if_match, database, queue, actor)


async def _body(request: Request) -> bytes:
    return await request.body()


@router.put(
    "/spine/initial",
    dependencies=[Depends(csv_body), Depends(_body), WriteTurn],
    responses={**_JOB, **problems(404, 409, 412, 413, 415, 422, 428)},
    response_model=StoredSpineSetup,
    openapi_extra=_CSV,
)
def put_initial_spine(
    surgery_id: SurgeryId,
    content: Annotated[bytes, Depends(_body)],
    database: DatabaseDep,
    queue: QueueDep,
    actor: ActorDep,
    frame: Annotated[
        Literal["object", "patient"],
        Query(description="Axes of the positions: object space of the baseline stage, or patient axes."),
    ] = "patient",
    if_match: IfMatch = None,
) -> Response:
    """Replace the initial configuration by vertebra poses in a CSV file; angles are in patient axes.

    `If-Match` must name the setup by its ETag.
    """
    initial = parse_poses(content, frame)

    def replaced(session: Session) -> SpineSetup:
        return spine_setups.get(session, surgery_id).setup.model_copy(update={"initial": initial})

    return _store(surgery_id, replaced, if_match, database, queue, actor)


@router.get("/spine", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StoredSpineSetup)
def get_spine_setup(
    surgery_id: SurgeryId, database: DatabaseDep, if_none_match: IfNoneMatch = None
) -> Response:
    """Get the latest setup of a surgery."""
    with database.read() as session:
        stored = spine_setups.get(session, surgery_id)
    return document_response(stored, if_none_match)


@router.get(
    "/spine/revisions",
    responses={**NOT_MODIFIED, **problems(404, 422)},
    response_model=Listing[SetupRevision],
)
def list_spine_setups(surgery_id: SurgeryId, database: DatabaseDep, part: PartDep) -> Response:
    """List all revisions of a surgery's setup, newest first, with the markers clamped again up to the next one."""
    paging = Paging(part.limit, "-revision", part.cursor, surgery_id=surgery_id)
    with database.read() as session:
        found = spine_setups.revisions(session, surgery_id)
    page = paging.page_of(found[::-1], lambda item: Position(str(item.revision), item.surgery_id))
    listing = Listing[SetupRevision].model_validate(paging.document(page, page.items))
    return document_response(listing, part.if_none_match)


@router.post(
    "/spine/rebaselines",
    status_code=201,
    dependencies=[Depends(json_body), WriteTurn],
    responses=problems(404, 409, 413, 415, 422),
    response_model=StoredRebaseline,
)
def create_rebaseline(
    surgery_id: SurgeryId,
    new: Annotated[NewRebaseline, Body()],
    once: OnceDep,
    queue: QueueDep,
    actor: ActorDep,
) -> Response:
    """Store that a marker was clamped again between two stages while the spine did not move."""
    now = utc_now()
    with once.write() as session:
        setup = spine_setups.get(session, surgery_id).setup
        check_rebaseline(new, setup, spine_setups.context(session, surgery_id))
        stored = spine_setups.add_rebaseline(session, surgery_id, new, now, actor)
        job_id = spine_jobs.submit(session, surgery_id, now)
        answer = once.answer(stored, 201)
    if job_id is not None:
        enqueue(queue, job_id)
    return answer


@router.get(
    "/stages/{name}/spine", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageSpine
)
def get_stage_spine(
    surgery_id: SurgeryId, name: StagePath, database: DatabaseDep, if_none_match: IfNoneMatch = None
) -> Response:
    """Get the spine of a measured stage: vertebrae, curves, measures, and what changed since earlier stages."""
    with database.read() as session:
        text = spines.get(session, surgery_id, name)
    return document_response(text, if_none_match)


@router.post(
    "/spine/computations",
    status_code=202,
    dependencies=[WriteTurn],
    responses={**ACCEPTED, **problems(404, 409, 422)},
    response_model=Job,
)
def compute_spines(surgery_id: SurgeryId, once: OnceDep, queue: QueueDep) -> Response:
    """Compute the spines that are missing or out of date again, for example after their job has failed.

    A job that is queued already is answered instead of another one.
    """
    with once.write() as session:
        job_id = spine_jobs.resubmit(session, surgery_id, utc_now())
        session.flush()
        job = job_of(jobs.get(session, job_id), None)
        answer = once.answer(job, 202, Location=f"/v1/jobs/{job_id}")
    enqueue(queue, job_id)
    return answer


def _store(
    surgery_id: str,
    make: Callable[[Session], SpineSetup],
    if_match: str | None,
    database: Database,
    queue: JobQueue,
    actor: Actor,
) -> Response:
    """Check and store the setup that ``make`` returns in the transaction, and submit the job if it is a new one."""
    now = utc_now()
    with database.write() as session:
        setup = make(session)
        check_setup(setup, spine_setups.context(session, surgery_id))
        current = spine_setups.find(session, surgery_id)
        if if_match is not None or (current is not None and current.setup != setup):
            require_match(if_match, current)
        changed = spine_setups.put(session, surgery_id, setup, now, actor)
        job_id = spine_jobs.submit(session, surgery_id, now) if changed else None
        stored = spine_setups.get(session, surgery_id)
    if job_id is not None:
        enqueue(queue, job_id)
    answer = document_response(stored, None)
    if job_id is not None:
        answer.headers["Location"] = f"/v1/jobs/{job_id}"
    return answer
