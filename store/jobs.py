"""Jobs: which worker may do the work on a subject, and how the work ends.

The job's row is the truth. A worker claims it under a lease whose owner is a new UUID, and every later statement
of that worker names the owner: once another worker has claimed the job, or it was cancelled, the statement changes
no row. An expired lease that nobody has claimed still belongs to its owner. A kind of job is a name: nothing here
depends on it (workers/registry.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, cast
from uuid import uuid4

from sqlalchemy import ColumnElement, CursorResult, Update, and_, or_, select, update
from sqlalchemy.orm import Session, joinedload

from contract.event import Actor
from contract.job import FINAL_STATES, JobState
from store import events
from store.errors import JobFinishedError, NotFoundError
from store.events import Action
from store.tables import Document, Job

ATTEMPTS_EXHAUSTED = "attempts-exhausted"
"""Code of the error of a job that never ended."""


@dataclass(frozen=True)
class Lease:
    """The right of one attempt to work on a job.

    Attributes
    ----------
    job_id
        The job.
    kind
        Its kind.
    subject_id
        Identifier of what the work is for.
    payload
        What the handler needs besides the subject.
    owner
        UUID of the attempt.
    attempt
        Number of the attempt, from 1.
    """

    job_id: str
    kind: str
    subject_id: str
    payload: Mapping[str, Any]
    owner: str
    attempt: int

    @property
    def surgery_id(self) -> str | None:
        """The surgery that the work belongs to, None for work outside a surgery."""
        return self.payload.get("surgery_id")


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


def claim(
    session: Session, job_id: str, now: datetime, lease: timedelta, max_attempts: int, actor: Actor
) -> Lease | None:
    """Claim a job that is queued, or whose lease has expired; one that has used all its attempts fails instead.

    Parameters
    ----------
    session
        Session that writes.
    job_id
        Identifier of the job.
    now
        Time of the claim.
    lease
        Duration of the lease.
    max_attempts
        Number of attempts after which the job fails.
    actor
        The worker.

    Returns
    -------
    Lease or None
        The lease, None when the job cannot be claimed.
    """
    job = session.scalars(
        select(Job).where(Job.id == job_id, _claimable(now)).with_for_update()
    ).one_or_none()
    if job is None:
        return None
    if job.attempts >= max_attempts:
        sentence = f"the job was started {job.attempts} times and never ended; see the workers' log"
        _end(job, JobState.FAILED, now, {"code": ATTEMPTS_EXHAUSTED, "detail": sentence})
        events.append(session, now, actor, Action.JOB_FAILED, job.id, job.surgery_id)
        return None
    job.state = JobState.RUNNING
    job.attempts += 1
    job.lease_owner = str(uuid4())
    job.lease_until = now + lease
    job.progress, job.step = 0.0, None
    job.started_at = job.started_at or now
    events.append(session, now, actor, Action.JOB_STARTED, job.id, job.surgery_id)
    return Lease(job.id, job.kind, job.subject_id, job.payload, job.lease_owner, job.attempts)


def heartbeat(session: Session, lease: Lease, until: datetime, progress: float, step: str | None) -> bool:
    """Extend a lease and store the progress of the work.

    Parameters
    ----------
    session
        Session that writes.
    lease
        The lease.
    until
        Its new end.
    progress
        Fraction of the work that is done, 0 to 1.
    step
        The current step.

    Returns
    -------
    bool
        Whether the lease is still held.
    """
    return _update(session, lease, lease_until=until, progress=min(max(progress, 0.0), 1.0), step=step)


def succeed(session: Session, lease: Lease, now: datetime) -> bool:
    """End a job; the caller stores its result in the same transaction, only when the lease is still held.

    Parameters
    ----------
    session
        Session that writes.
    lease
        The lease.
    now
        Time of the end.

    Returns
    -------
    bool
        Whether the lease is still held; otherwise nothing is written.
    """
    return _update(
        session,
        lease,
        state=JobState.SUCCEEDED,
        progress=1.0,
        step=None,
        finished_at=now,
        lease_owner=None,
        lease_until=None,
    )


def fail(session: Session, lease: Lease, code: str, detail: str, now: datetime, actor: Actor) -> bool:
    """End a job that can never succeed.

    Parameters
    ----------
    session
        Session that writes.
    lease
        The lease.
    code
        Name of the error, for machines.
    detail
        What is wrong and what to do, for people.
    now
        Time of the end.
    actor
        The worker.

    Returns
    -------
    bool
        Whether the lease is still held; otherwise nothing is written.
    """
    error = {"code": code, "detail": detail}
    ended = _update(
        session,
        lease,
        state=JobState.FAILED,
        error=error,
        finished_at=now,
        lease_owner=None,
        lease_until=None,
    )
    if ended:
        events.append(session, now, actor, Action.JOB_FAILED, lease.job_id, lease.surgery_id)
    return ended


def requeue(session: Session, lease: Lease, now: datetime, actor: Actor, *, count_attempt: bool) -> bool:
    """Return a job to the queue for another attempt.

    Parameters
    ----------
    session
        Session that writes.
    lease
        The lease.
    now
        Time of the return; the caller enqueues the job.
    actor
        The worker.
    count_attempt
        Whether this attempt counts; False for a worker that is stopped, which is no fault of the job.

    Returns
    -------
    bool
        Whether the lease is still held; otherwise nothing is written.
    """
    attempts = lease.attempt if count_attempt else lease.attempt - 1
    returned = _update(
        session,
        lease,
        state=JobState.QUEUED,
        attempts=attempts,
        progress=0.0,
        step=None,
        enqueued_at=now,
        lease_owner=None,
        lease_until=None,
    )
    if returned:
        events.append(session, now, actor, Action.JOB_REQUEUED, lease.job_id, lease.surgery_id)
    return returned


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
    _end(job, JobState.CANCELLED, now, None)
    events.append(session, now, actor, Action.JOB_CANCELLED, job.id, job.surgery_id)
    return job


def stalled(session: Session, now: datetime, quiet: timedelta) -> list[str]:
    """Return the jobs that could be claimed and that were not enqueued recently.

    Parameters
    ----------
    session
        Session that reads.
    now
        The time.
    quiet
        Time since a job was enqueued in which it is not stalled.

    Returns
    -------
    list of str
        Identifiers, oldest job first.
    """
    query = (
        select(Job.id).where(_claimable(now), Job.enqueued_at <= now - quiet).order_by(Job.created_at, Job.id)
    )
    return list(session.scalars(query))


def mark_enqueued(session: Session, job_id: str, now: datetime, quiet: timedelta) -> bool:
    """Store that a stalled job is enqueued again, so that only one of several workers does so.

    Parameters
    ----------
    session
        Session that writes.
    job_id
        Identifier of the job.
    now
        The time.
    quiet
        As of ``stalled``.

    Returns
    -------
    bool
        Whether it was stalled; False when another worker has just enqueued it.
    """
    query = update(Job).where(Job.id == job_id, _claimable(now), Job.enqueued_at <= now - quiet)
    return _changes_one(session, query.values(enqueued_at=now))


def _claimable(now: datetime) -> ColumnElement[bool]:
    return or_(Job.state == JobState.QUEUED, and_(Job.state == JobState.RUNNING, Job.lease_until < now))


def _end(job: Job, state: JobState, now: datetime, error: Document | None) -> None:
    job.state, job.error, job.finished_at = state, error, now
    job.lease_owner = job.lease_until = None


def _update(session: Session, lease: Lease, **values: Any) -> bool:
    held = (Job.id == lease.job_id, Job.lease_owner == lease.owner, Job.state == JobState.RUNNING)
    return _changes_one(session, update(Job).where(*held).values(**values))


def _changes_one(session: Session, statement: Update) -> bool:
    result = session.execute(statement, execution_options={"synchronize_session": False})
    return cast("CursorResult[Any]", result).rowcount == 1
