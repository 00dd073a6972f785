"""Jobs: their state and progress, the wait for their end, and their cancellation."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session
from starlette.concurrency import run_in_threadpool

from contract.base import Identifier
from contract.job import FINAL_STATES, Job, JobState
from contract.page import Listing
from contract.problem import Problem
from service.dependencies import ActorDep, AdmissionDep, DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.idempotency import OnceDep
from service.paging import CreatedDep, CreatedSort, Paging, PartDep, StateFilter
from service.parameters import JobId
from service.problems import problem
from service.turns import WriteTurn
from service.watch import WatchDep
from store import job_lists, jobs, leases, retention, tables
from store.clock import utc_now
from store.database import Database

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


def job_of(row: tables.jobs.Job, stage: tables.stages.Stage | None) -> Job:
    """Return the model of a row; ``stage`` is the one that the job measures, if any."""
    calibrates = row.kind == tables.jobs.CALIBRATION_JOB and row.state is JobState.SUCCEEDED
    return Job(
        id=row.id,
        kind=row.kind,
        surgery_id=row.surgery_id,
        stage=None if stage is None else stage.name,
        take=None if stage is None else stage.take,
        calibration_id=row.subject_id if calibrates else None,
        state=row.state,
        progress=row.progress,
        step=row.step,
        attempts=row.attempts,
        error=_error(row),
        created_at=row.created_at,
        started_at=row.started_at,
        finished_at=row.finished_at,
    )


@router.get("", responses={**NOT_MODIFIED, **problems(422)}, response_model=Listing[Job])
def list_jobs(
    database: DatabaseDep,
    part: PartDep,
    created: CreatedDep,
    sort: CreatedSort = "-created_at",
    state: StateFilter = None,
    kind: Annotated[
        str | None, Query(max_length=64, description="Only jobs of this kind: stage, calibration, spine.")
    ] = None,
    surgery_id: Annotated[Identifier | None, Query(description="Only jobs of this surgery.")] = None,
) -> Response:
    """List the jobs, newest first."""
    filters: dict[str, Any] = {"state": state, "kind": kind, "surgery_id": surgery_id, **created}
    paging = Paging(part.limit, sort, part.cursor, **filters)
    with database.read() as session:
        page = job_lists.listed(session, paging.wanted, **filters)
    items = [job_of(row, row.stage) for row in page.items]
    return document_response(Listing[Job].model_validate(paging.document(page, items)), part.if_none_match)


@router.get("/{job_id}", responses={**NOT_MODIFIED, **problems(404, 410, 422)}, response_model=Job)
async def get_job(
    job_id: JobId,
    database: DatabaseDep,
    watch: WatchDep,
    admission: AdmissionDep,
    wait: Annotated[
        float,
        Query(
            ge=0,
            le=60,
            description="Seconds to wait for the end of the job before it is answered as it is then.",
        ),
    ] = 0.0,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get a job, at once or when it has ended."""
    job = await run_in_threadpool(_read, database, job_id)
    if wait and job.state not in FINAL_STATES:
        await watch.job_end(job_id, wait, admission)
        job = await run_in_threadpool(_read, database, job_id)
    return document_response(job, if_none_match)


@router.post(
    "/{job_id}/cancel", dependencies=[WriteTurn], responses=problems(404, 409, 410), response_model=Job
)
def cancel_job(job_id: JobId, once: OnceDep, actor: ActorDep) -> Response:
    """Cancel a job that has not ended; if a worker is running it, the result is discarded."""
    with once.write() as session:
        _present(session, job_id)
        row = jobs.cancel(session, job_id, utc_now(), actor)
        return once.answer(job_of(row, row.stage), 200)


def _read(database: Database, job_id: str) -> Job:
    with database.read() as session:
        row = _present(session, job_id)
        return job_of(row, row.stage)


def _present(session: Session, job_id: str) -> tables.jobs.Job:
    """Return a job, unless its surgery was deleted: such a job answers as every path of the surgery does."""
    row = jobs.get(session, job_id)
    if row.surgery_id is not None:
        retention.require_present(session, row.surgery_id)
    return row


def _error(row: tables.jobs.Job) -> Problem | None:
    if row.error is None:
        return None
    code = row.error["code"]
    return problem(500 if code == leases.ATTEMPTS_EXHAUSTED else 422, row.error["detail"], code)
