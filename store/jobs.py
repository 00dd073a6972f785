"""Jobs: which worker may do the work on a subject, and how the work ends.

The job's row is the truth. A worker claims it under a lease whose owner is a new UUID, and every later statement
of that worker names the owner: once another worker has claimed the job, or it was cancelled, the statement changes
no row. An expired lease that nobody has claimed still belongs to its owner. A kind of job is a name: nothing here
depends on it (workers/registry.py).

No decision compares a stored time with a clock, because clocks are set and differ between hosts. A lease expires when a
sweep has seen for long enough, by its own monotonic clock, that the row does not change (workers/sweep.py).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, cast
from uuid import uuid4

from sqlalchemy import ColumnElement, CursorResult, Update, and_, func, or_, select, update
from sqlalchemy.orm import Session, aliased, joinedload

from contract.event import Actor
from contract.job import FINAL_STATES, JobState
from store import events
from store.errors import JobFinishedError, NotFoundError
from store.events import Action
from store.tables import Document, Event, Job

_MAX_STARTS = 20
"""Number of times that a job is started, ended workers included, which do not count as attempts."""
_RECENT_EVENTS = 10_000
"""Number of the latest events in which the last start of each surgery's jobs is looked for."""

ATTEMPTS_EXHAUSTED = "attempts-exhausted"
"""Code of the error of a job that never ended."""

_other = aliased(Job)
_unended = select(_other.id).where(_other.id == Job.waits_for, _other.state.not_in(tuple(FINAL_STATES)))
_CLAIMABLE: ColumnElement[bool] = or_(
    and_(Job.state == JobState.QUEUED, or_(Job.waits_for.is_(None), ~_unended.exists())),
    and_(Job.state == JobState.RUNNING, Job.lease_until.is_(None)),
)
_surgery: ColumnElement[str] = Job.payload["surgery_id"].as_string()
_GROUPS = select(_surgery).where(_CLAIMABLE).distinct()
_OLDEST = select(Job).where(_CLAIMABLE).order_by(Job.created_at, Job.id).limit(1).with_for_update()
_RUNNING = (
    select(_surgery, func.count())
    .where(Job.state == JobState.RUNNING, Job.lease_until.is_not(None))
    .group_by(_surgery)
)


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


@dataclass(frozen=True)
class Unended:
    """A job that is queued or running, as a sweep sees it.

    Attributes
    ----------
    id
        Identifier of the job.
    owner
        The attempt that works on it, None for a queued one.
    stamp
        A time that each heartbeat, and each return to the queue, changes.
    claimable
        Whether it can be claimed.
    """

    id: str
    owner: str | None
    stamp: datetime
    claimable: bool


def claim_next(
    session: Session, now: datetime, lease: timedelta, max_attempts: int, actor: Actor
) -> Lease | None:
    """Claim the job whose turn it is.

    Surgeries take turns: first the one with the fewest running jobs, then the one whose last job was started longest
    ago. Work outside surgeries has one turn too. Within a surgery, jobs are in the order of their creation.

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
    while (job := _next(session)) is not None:
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
    job = session.scalars(select(Job).where(Job.id == job_id, _CLAIMABLE).with_for_update()).one_or_none()
    return None if job is None else _claim(session, job, now, lease, max_attempts, actor)


def _claim(
    session: Session, job: Job, now: datetime, lease: timedelta, max_attempts: int, actor: Actor
) -> Lease | None:
    """Claim a job that can be claimed and whose row is locked."""
    interrupted = job.state is JobState.RUNNING
    problem = _exhausted(session, job, max_attempts, interrupted)
    if problem is not None:
        _end(job, JobState.FAILED, now, {"code": ATTEMPTS_EXHAUSTED, "detail": problem})
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
    _end(job, JobState.CANCELLED, now, None)
    events.append(session, now, actor, Action.JOB_CANCELLED, job.id, job.surgery_id)
    return job


def unended(session: Session) -> list[Unended]:
    """Return the jobs that are queued or running.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    list of Unended
        The jobs, the oldest first.
    """
    claimable = _CLAIMABLE.label("claimable")
    columns = Job.id, Job.lease_owner, func.coalesce(Job.lease_until, Job.enqueued_at), claimable
    query = select(*columns).where(Job.state.in_((JobState.QUEUED, JobState.RUNNING)))
    return [
        Unended(job_id, owner, stamp, bool(ready))
        for job_id, owner, stamp, ready in session.execute(query.order_by(Job.created_at, Job.id))
    ]


def expire(session: Session, job: Unended) -> bool:
    """End the lease of a running job that has not changed for too long; the job can then be claimed.

    Parameters
    ----------
    session
        Session that writes.
    job
        The job as it was seen.

    Returns
    -------
    bool
        Whether it was still so.
    """
    seen = (Job.id == job.id, Job.state == JobState.RUNNING, Job.lease_owner == job.owner)
    return _changes_one(
        session, update(Job).where(*seen, Job.lease_until == job.stamp).values(lease_until=None)
    )


def mark_enqueued(session: Session, job: Unended, now: datetime) -> bool:
    """Store that a job is enqueued again, so that only one of several workers does so.

    Parameters
    ----------
    session
        Session that writes.
    job
        The job as it was seen.
    now
        The time.

    Returns
    -------
    bool
        Whether it was still so; False when another worker has just enqueued or claimed it.
    """
    query = update(Job).where(Job.id == job.id, _CLAIMABLE, Job.enqueued_at == job.stamp)
    return _changes_one(session, query.values(enqueued_at=now))


def _next(session: Session) -> Job | None:
    """Return the job whose turn it is, with its row locked."""
    groups: list[str | None] = list(session.scalars(_GROUPS))
    if not groups:
        return None
    turn = groups[0] if len(groups) == 1 else min(groups, key=_turns(session, groups))
    return session.scalars(
        _OLDEST.where(_surgery.is_(None) if turn is None else _surgery == turn)
    ).one_or_none()


def _turns(session: Session, groups: Collection[str | None]) -> Callable[[str | None], tuple[int, int, str]]:
    """Return the key by which surgeries are ordered, the one whose turn it is first."""
    running: dict[str | None, int] = {group: count for group, count in session.execute(_RUNNING)}  # noqa: C416 - rows are no pairs
    newest = session.scalar(select(func.max(Event.seq))) or 0
    recent = (Event.action == Action.JOB_STARTED, Event.seq > newest - _RECENT_EVENTS)
    named = Event.surgery_id.in_([group for group in groups if group is not None])
    last = select(Event.surgery_id, func.max(Event.seq)).where(named, *recent).group_by(Event.surgery_id)
    started: dict[str | None, int] = {group: seq for group, seq in session.execute(last)}  # noqa: C416 - as above
    if None in groups:
        outside = select(func.max(Event.seq)).where(Event.surgery_id.is_(None), *recent)
        started[None] = session.scalar(outside) or 0
    return lambda group: (running.get(group, 0), started.get(group, 0), group or "")


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


def _end(job: Job, state: JobState, now: datetime, error: Document | None) -> None:
    job.state, job.error, job.finished_at = state, error, now
    job.lease_owner = job.lease_until = None


def _update(session: Session, lease: Lease, **values: Any) -> bool:
    held = (Job.id == lease.job_id, Job.lease_owner == lease.owner, Job.state == JobState.RUNNING)
    return _changes_one(session, update(Job).where(*held).values(**values))


def _changes_one(session: Session, statement: Update) -> bool:
    result = session.execute(statement, execution_options={"synchronize_session": False})
    return cast("CursorResult[Any]", result).rowcount == 1
