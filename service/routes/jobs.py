"""Jobs: how far the work on a stage or a calibration is, and stopping it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from contract.base import Identifier, Problem, Schema, StageName, Timestamp
from service.dependencies import TheDatabase, problems
from service.problems import problem
from store import jobs
from store.clock import utc_now
from store.tables import Job, JobKind, JobState, Stage

router = APIRouter(prefix="/v1/jobs", tags=["jobs"])


class JobDocument(Schema):
    """The work on one take of a stage, or on a calibration from pictures."""

    id: Identifier
    kind: Annotated[JobKind, Field(description="What it makes: a stage's measurement or a calibration.")]
    surgery_id: Annotated[Identifier | None, Field(description="Null for a calibration.")]
    stage: Annotated[StageName | None, Field(description="Null for a calibration.")]
    take: Annotated[int | None, Field(description="Null for a calibration.")]
    calibration_id: Annotated[
        Identifier | None, Field(description="The calibration that was made, once the job has succeeded.")
    ]
    state: JobState
    progress: Annotated[float, Field(ge=0, le=1, description="Part of the work that is done.")]
    step: Annotated[str | None, Field(description="What is being done now.", examples=["detect"])]
    attempts: Annotated[int, Field(description="How often a worker has started it.")]
    error: Annotated[Problem | None, Field(description="Why it failed.")]
    created_at: Timestamp
    started_at: Timestamp | None
    finished_at: Timestamp | None

    @classmethod
    def of(cls, job: Job, stage: Stage | None) -> JobDocument:
        """Return the document of a job and of the stage that it measures, if it does."""
        succeeded = job.state is JobState.SUCCEEDED
        return cls(
            id=job.id,
            kind=job.kind,
            surgery_id=None if stage is None else stage.surgery_id,
            stage=None if stage is None else stage.name,
            take=None if stage is None else stage.take,
            calibration_id=job.calibration_request_id if succeeded else None,
            state=job.state,
            progress=job.progress,
            step=job.step,
            attempts=job.attempts,
            error=_error(job),
            created_at=job.created_at,
            started_at=job.started_at,
            finished_at=job.finished_at,
        )


@router.get("/{job_id}", responses=problems(404))
def get_job(job_id: str, record: TheDatabase) -> JobDocument:
    """Show a job."""
    with record.reading() as session:
        job = jobs.get(session, job_id)
    return JobDocument.of(job, job.stage)


@router.post("/{job_id}/cancel", responses=problems(404, 409))
def cancel_job(job_id: str, record: TheDatabase) -> JobDocument:
    """Cancel a job that has not ended; what a worker may still find out about it is thrown away."""
    with record.writing() as session:
        job = jobs.cancel(session, job_id, utc_now())
    return JobDocument.of(job, job.stage)


def _error(job: Job) -> Problem | None:
    if job.error is None:
        return None
    code = job.error["code"]
    return problem(500 if code == jobs.ATTEMPTS_EXHAUSTED else 422, job.error["detail"], code)
