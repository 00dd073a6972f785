"""Leases: which worker may work on a job, and how its work ends.

A worker claims a job under a lease whose owner is a new UUID, and every later statement of that worker names the owner:
once another worker has claimed the job, or it was cancelled, the statement changes no row. An expired lease that nobody
has claimed still belongs to its owner.

No decision compares a stored time with a clock, because clocks are set and differ between hosts. A lease expires when a
sweep has seen for long enough, by its own monotonic clock, that the row does not change (store/job_sweep.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any
from uuid import uuid4

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from contract.event import Actor
from contract.job import JobState
from store import events, jobs, turns
from store.events import Action
from store.tables.events import Event
from store.tables.jobs import Job

_MAX_STARTS = 20
"""Number of times that a job is started, ended workers included, which do not count as attempts."""

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


def claim_next(
    session: Session, now: datetime, lease: timedelta, max_attempts: int, actor: Actor
) -> Lease | None:
    """Claim the job whose turn it is (store/turns.py).

    Parameters
    ----------
    session
        Session that writes.
    now
        Time of the claim.
    lease
        Duration of the lease.
    max_attempts
        Number of attempts after which a job fails.
    actor
        The worker.

    Returns
    -------
    Lease or None
        The lease, None when no job can be claimed.
    """
    while (job := turns.next_job(session)) is not None:
        claimed = _claim(session, job, now, lease, max_attempts, actor)
        if claimed is not None:
            return claimed
        session.flush()  # the job has failed: the next one
    return None


def claim(
    session: Session, job_id: str, now: datetime, lease: timedelta, max_attempts: int, actor: Actor
) -> Lease | None:
    """Claim a job that is queued, or whose lease has expired; one that has used all its attempts fails instead.

    A queued job that waits for another one (`requeue`) cannot be claimed before that has ended. An attempt whose lease
    expired does not count: its worker was killed or cut off, which is no fault of the job.

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
        select(Job).where(Job.id == job_id, turns.CLAIMABLE).with_for_update()
    ).one_or_none()
    return None if job is None else _claim(session, job, now, lease, max_attempts, actor)


def heartbeat(session: Session, lease: Lease, until: datetime, progress: float, step: str | None) -> bool:
    """Extend a lease and store the progress of the work.

    Parameters
    ----------
    session
        Session that writes.
    lease
        The lease.
    until
        Its new end by the clock of this host; that it changes is what counts.
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


def requeue(
    session: Session,
    lease: Lease,
    now: datetime,
    actor: Actor,
    *,
    count_attempt: bool,
    waits_for: str | None = None,
) -> bool:
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
    waits_for
        Identifier of a job that must end before this one can be claimed; None if there is none.

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
        waits_for=waits_for,
        enqueued_at=now,
        lease_owner=None,
        lease_until=None,
    )
    if returned:
        events.append(session, now, actor, Action.JOB_REQUEUED, lease.job_id, lease.surgery_id)
    return returned


def _claim(
    session: Session, job: Job, now: datetime, lease: timedelta, max_attempts: int, actor: Actor
) -> Lease | None:
    """Claim a job that can be claimed and whose row is locked."""
    interrupted = job.state is JobState.RUNNING
    problem = _exhausted(session, job, max_attempts, interrupted)
    if problem is not None:
        jobs.end(job, JobState.FAILED, now, {"code": ATTEMPTS_EXHAUSTED, "detail": problem})
        events.append(session, now, actor, Action.JOB_FAILED, job.id, job.surgery_id)
        return None
    if not interrupted:
        job.attempts += 1
    job.state = JobState.RUNNING
    job.lease_owner = str(uuid4())
    job.lease_until = now + lease
    job.progress, job.step, job.waits_for = 0.0, None, None
    job.started_at = job.started_at or now
    events.append(session, now, actor, Action.JOB_STARTED, job.id, job.surgery_id)
    return Lease(job.id, job.kind, job.subject_id, job.payload, job.lease_owner, job.attempts)


def _exhausted(session: Session, job: Job, max_attempts: int, interrupted: bool) -> str | None:
    """Return why a job is not started again, None if it is."""
    if not interrupted:
        if job.attempts < max_attempts:
            return None
        return f"the job was started {job.attempts} times and never ended; see the workers' log"
    started = (Event.subject_id == job.id, Event.action == Action.JOB_STARTED)
    place = () if job.surgery_id is None else (Event.surgery_id == job.surgery_id,)
    starts = session.scalar(select(func.count()).select_from(Event).where(*started, *place)) or 0
    if starts < _MAX_STARTS:
        return None
    return f"{starts} workers ended while they worked on the job; see the workers' log"


def _update(session: Session, lease: Lease, **values: Any) -> bool:
    held = (Job.id == lease.job_id, Job.lease_owner == lease.owner, Job.state == JobState.RUNNING)
    return jobs.changes_one(session, update(Job).where(*held).values(**values))
