"""What a sweep sees of the jobs that have not ended, and what it changes (workers/sweep.py).

A change is made only if the job's row is still as it was seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from contract.job import JobState
from store.jobs import changes_one
from store.tables.jobs import Job
from store.turns import CLAIMABLE


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
    claimable = CLAIMABLE.label("claimable")
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
    return changes_one(
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
    query = update(Job).where(Job.id == job.id, CLAIMABLE, Job.enqueued_at == job.stamp)
    return changes_one(session, query.values(enqueued_at=now))
