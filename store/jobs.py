"""Jobs: how one begins, and how it is found and cancelled.

The job's row is the truth; which worker may do the work is decided by its lease (store/leases.py). A kind of job is a
name: nothing here depends on it (workers/registry.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any, cast
from uuid import uuid4

from sqlalchemy import CursorResult, Update, select
from sqlalchemy.orm import Session, joinedload

from contract.event import Actor
from contract.job import FINAL_STATES, JobState
from store import events
from store.errors import JobFinishedError, NotFoundError
from store.events import Action
from store.tables.base import Document
from store.tables.jobs import Job


def add(
    session: Session, kind: str, subject_id: str, now: datetime, payload: Mapping[str, Any] | None = None
) -> Job:
    """Add a queued job; the caller enqueues its identifier after the commit.

    Parameters
    ----------
    session
        Session that writes.
    kind
        Kind of the job.
    subject_id
        Identifier of what the work is for.
    now
        Time of its creation.
    payload
        What the handler needs besides the subject, as JSON; ``surgery_id`` in it is written into the job's events.

    Returns
    -------
    Job
        The new row.
    """
    job = Job(
        id=str(uuid4()),
        kind=kind,
        subject_id=subject_id,
        payload=dict(payload or {}),
        state=JobState.QUEUED,
        progress=0.0,
        attempts=0,
        enqueued_at=now,
        created_at=now,
    )
    session.add(job)
    return job


def get(session: Session, job_id: str) -> Job:
    """Return a job with the stage that it measures, if it does.

    Parameters
    ----------
    session
        Session that reads.
    job_id
        Identifier of the job.

    Returns
    -------
    Job
        The row.

    Raises
    ------
    NotFoundError
        There is no such job.
    """
    job = session.scalars(select(Job).where(Job.id == job_id).options(joinedload(Job.stage))).one_or_none()
    if job is None:
        raise NotFoundError("job")
    return job


def has_ended(session: Session, job_id: str) -> bool:
    """Return whether a job has succeeded, failed or been cancelled.

    Parameters
    ----------
    session
        Session that reads.
    job_id
        Identifier of the job.

    Returns
    -------
    bool
        Whether it has ended.
    """
    return session.scalar(select(Job.state).where(Job.id == job_id)) in FINAL_STATES


def waiting_for(session: Session, job_id: str) -> tuple[str, ...]:
    """Return the queued jobs that wait for a job.

    Parameters
    ----------
    session
        Session that reads.
    job_id
        Identifier of the job that they wait for.

    Returns
    -------
    tuple of str
        Identifiers, oldest job first.
    """
    waiting = select(Job.id).where(Job.waits_for == job_id, Job.state == JobState.QUEUED)
    return tuple(session.scalars(waiting.order_by(Job.created_at, Job.id)))


def cancel(session: Session, job_id: str, now: datetime, actor: Actor) -> Job:
    """Cancel a job that has not ended; a worker that works on it loses its lease.

    Parameters
    ----------
    session
        Session that writes.
    job_id
        Identifier of the job.
    now
        Time of the cancellation.
    actor
        Who cancels.

    Returns
    -------
    Job
        The row, with the stage that it measures, if it does.

    Raises
    ------
    NotFoundError
        There is no such job.
    JobFinishedError
        The job has ended.
    """
    job = session.scalars(
        select(Job).where(Job.id == job_id).options(joinedload(Job.stage)).with_for_update(of=Job)
    ).one_or_none()
    if job is None:
        raise NotFoundError("job")
    if job.state in FINAL_STATES:
        raise JobFinishedError(
            f"the job is {job.state.value} already; only a job that has not ended can be cancelled"
        )
    end(job, JobState.CANCELLED, now, None)
    events.append(session, now, actor, Action.JOB_CANCELLED, job.id, job.surgery_id)
    return job


def end(job: Job, state: JobState, now: datetime, error: Document | None) -> None:
    """End a job whose row is locked.

    Parameters
    ----------
    job
        The row.
    state
        How it ends.
    now
        Time of the end.
    error
        Its error, None for one that is cancelled.
    """
    job.state, job.error, job.finished_at = state, error, now
    job.lease_owner = job.lease_until = None


def changes_one(session: Session, statement: Update) -> bool:
    """Change the row of a job if it is still as the statement says.

    Parameters
    ----------
    session
        Session that writes.
    statement
        The change, with its conditions.

    Returns
    -------
    bool
        Whether the row was changed.
    """
    result = session.execute(statement, execution_options={"synchronize_session": False})
    return cast("CursorResult[Any]", result).rowcount == 1
