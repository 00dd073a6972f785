"""Jobs: who may work on a stage or a calibration, and how the work ends.

The job's row is the truth. A worker claims it under a lease whose owner is a fresh UUID, and every later
statement of that worker names the owner: once another has claimed the job, or it was cancelled, the statement
touches no row. An expired lease that nobody took is still its owner's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, cast
from uuid import uuid4

from sqlalchemy import ColumnElement, CursorResult, Update, and_, or_, select, update
from sqlalchemy.orm import Session, joinedload

from store import calibrations, events
from store.errors import JobFinishedError, NotFoundError
from store.events import Action
from store.results import measurement_of
from store.tables import FINAL_STATES, Document, Job, JobKind, JobState

ATTEMPTS_EXHAUSTED = "attempts-exhausted"


@dataclass(frozen=True)
class Lease:
    """The right of one attempt to work on a job; ``subject_id`` is the stage's or the calibration request's."""

    job_id: str
    kind: JobKind
    subject_id: str
    surgery_id: str | None
    owner: str
    attempt: int


def queued(now: datetime) -> Job:
    """Return a new job, rung for at once."""
    return Job(id=str(uuid4()), state=JobState.QUEUED, progress=0.0, attempts=0, rung_at=now, created_at=now)


def get(session: Session, job_id: str) -> Job:
    """Return a job with the stage that it measures, if it does; raise ``NotFoundError``."""
    job = session.scalars(select(Job).where(Job.id == job_id).options(joinedload(Job.stage))).one_or_none()
    if job is None:
        raise NotFoundError("job")
    return job


def claim(session: Session, job_id: str, now: datetime, lease: timedelta, max_attempts: int) -> Lease | None:
    """Take a job that waits, or whose lease ran out; None when there is nothing to take.

    A job that has used all its attempts fails here instead.
    """
    job = session.scalars(
        select(Job)
        .where(Job.id == job_id, _claimable(now))
        .options(joinedload(Job.stage))
        .with_for_update(of=Job)
    ).one_or_none()
    if job is None:
        return None
    if job.attempts >= max_attempts:
        sentence = f"the job was started {job.attempts} times and never ended; see the workers' log"
        _end(job, JobState.FAILED, now, {"code": ATTEMPTS_EXHAUSTED, "detail": sentence})
        events.append(session, now, Action.JOB_FAILED, job.id, _surgery_of(job))
        return None
    job.state = JobState.RUNNING
    job.attempts += 1
    job.lease_owner = str(uuid4())
    job.lease_until = now + lease
    job.progress, job.step = 0.0, None
    job.started_at = job.started_at or now
    events.append(session, now, Action.JOB_STARTED, job.id, _surgery_of(job))
    subject_id = cast(str, job.stage_id or job.calibration_request_id)
    return Lease(job.id, job.kind, subject_id, _surgery_of(job), job.lease_owner, job.attempts)


def extend(session: Session, lease: Lease, until: datetime, progress: float, step: str | None) -> bool:
    """Prolong a lease and note how far the work is; False when the lease is lost."""
    return _update(session, lease, lease_until=until, progress=min(max(progress, 0.0), 1.0), step=step)


def succeed(session: Session, lease: Lease, result: Mapping[str, Any], now: datetime) -> bool:
    """Write what a job made and end it; False, and nothing is written, when the lease is lost.

    ``result`` is the stage document (docs/api.md) with ``parameters`` and ``version``, or the calibration
    document with ``version``.
    """
    ended = _update(
        session,
        lease,
        state=JobState.SUCCEEDED,
        progress=1.0,
        step=None,
        finished_at=now,
        lease_owner=None,
        lease_until=None,
    )
    if ended and lease.kind is JobKind.CALIBRATION:
        calibrations.add_solved(session, lease.subject_id, result, now)
    elif ended:
        session.add(measurement_of(lease.subject_id, result, now))
        events.append(session, now, Action.STAGE_MEASURED, lease.subject_id, lease.surgery_id)
    return ended


def fail(session: Session, lease: Lease, code: str, detail: str, now: datetime) -> bool:
    """End a job that can never succeed; False when the lease is lost."""
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
        events.append(session, now, Action.JOB_FAILED, lease.job_id, lease.surgery_id)
    return ended


def requeue(session: Session, lease: Lease, now: datetime, *, count_attempt: bool) -> bool:
    """Give a job back to the queue; False when the lease is lost.

    ``count_attempt`` is False for a worker that stops in good order: that says nothing against the job.
    """
    attempts = lease.attempt if count_attempt else lease.attempt - 1
    returned = _update(
        session,
        lease,
        state=JobState.QUEUED,
        attempts=attempts,
        progress=0.0,
        step=None,
        rung_at=now,
        lease_owner=None,
        lease_until=None,
    )
    if returned:
        events.append(session, now, Action.JOB_REQUEUED, lease.job_id, lease.surgery_id)
    return returned


def cancel(session: Session, job_id: str, now: datetime) -> Job:
    """Cancel a job that has not ended; a worker at it finds its lease lost. Raises ``JobFinishedError``."""
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
    events.append(session, now, Action.JOB_CANCELLED, job.id, _surgery_of(job))
    return job


def unrung(session: Session, now: datetime, quiet: timedelta) -> list[str]:
    """Return the ids of jobs that could be claimed and for which nobody rang in the last ``quiet``."""
    query = select(Job.id).where(_claimable(now), Job.rung_at <= now - quiet).order_by(Job.created_at, Job.id)
    return list(session.scalars(query))


def note_ring(session: Session, job_id: str, now: datetime, quiet: timedelta) -> bool:
    """Note that the bell is rung for a job; False when somebody else has just done so."""
    query = update(Job).where(Job.id == job_id, _claimable(now), Job.rung_at <= now - quiet)
    return _touches(session, query.values(rung_at=now))


def _surgery_of(job: Job) -> str | None:
    return None if job.stage is None else job.stage.surgery_id


def _claimable(now: datetime) -> ColumnElement[bool]:
    return or_(Job.state == JobState.QUEUED, and_(Job.state == JobState.RUNNING, Job.lease_until < now))


def _end(job: Job, state: JobState, now: datetime, error: Document | None) -> None:
    job.state, job.error, job.finished_at = state, error, now
    job.lease_owner = job.lease_until = None


def _update(session: Session, lease: Lease, **values: Any) -> bool:
    mine = (Job.id == lease.job_id, Job.lease_owner == lease.owner, Job.state == JobState.RUNNING)
    return _touches(session, update(Job).where(*mine).values(**values))


def _touches(session: Session, statement: Update) -> bool:
    result = session.execute(statement, execution_options={"synchronize_session": False})
    return cast("CursorResult[Any]", result).rowcount == 1
