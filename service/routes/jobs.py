"""Jobs: their state and progress, and their cancellation."""

from __future__ import annotations

from fastapi import APIRouter

from contract.job import Job, JobState
from contract.problem import Problem
from service.dependencies import ActorDep, DatabaseDep, problems
from service.parameters import JobId
from service.problems import problem
from store import jobs, tables
from store.clock import utc_now

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


def job_of(row: tables.Job, stage: tables.Stage | None) -> Job:
    """Return the model of a row; ``stage`` is the one that the job measures, if any."""
    calibrates = row.kind == tables.CALIBRATION_JOB and row.state is JobState.SUCCEEDED
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


@router.get("/{job_id}", responses=problems(404))
def get_job(job_id: JobId, database: DatabaseDep) -> Job:
    """Get a job."""
    with database.read() as session:
        row = jobs.get(session, job_id)
    return job_of(row, row.stage)


@router.post("/{job_id}/cancel", responses=problems(404, 409))
def cancel_job(job_id: JobId, database: DatabaseDep, actor: ActorDep) -> Job:
    """Cancel a job that has not ended; if a worker is running it, the result is discarded."""
    with database.write() as session:
        row = jobs.cancel(session, job_id, utc_now(), actor)
    return job_of(row, row.stage)


def _error(row: tables.Job) -> Problem | None:
    if row.error is None:
        return None
    code = row.error["code"]
    return problem(500 if code == jobs.ATTEMPTS_EXHAUSTED else 422, row.error["detail"], code)
