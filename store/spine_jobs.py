"""Jobs that compute the spines of a surgery: one waits at most, which will see every change before it is claimed."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from contract.job import JobState
from store import jobs, spine_setups
from store.tables.jobs import SPINE_JOB, Job
from store.tables.spines import SpineSetup


def submit(session: Session, surgery_id: str, now: datetime) -> str | None:
    """Add a job that computes the spines of a surgery, in the transaction that changes one of its inputs.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    now
        Time of the change.

    Returns
    -------
    str or None
        Identifier of the job, which the caller enqueues after the commit. None when the surgery has no setup, or has a
        queued job, which will see the change.
    """
    setup = select(SpineSetup.revision).where(SpineSetup.surgery_id == surgery_id)
    if session.scalars(setup).first() is None or queued(session, surgery_id) is not None:
        return None
    return _new(session, surgery_id, now)


def resubmit(session: Session, surgery_id: str, now: datetime) -> str:
    """Return the job that computes the spines of a surgery, a new one unless one is queued.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    now
        Time of the request.

    Returns
    -------
    str
        Identifier of the job, which the caller enqueues after the commit.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    SetupMissingError
        The surgery has no setup.
    """
    spine_setups.get(session, surgery_id)
    return queued(session, surgery_id) or _new(session, surgery_id, now)


def queued(session: Session, surgery_id: str) -> str | None:
    """Return the queued job that computes the spines of a surgery, and keep workers from claiming it meanwhile.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    str or None
        Identifier of the job, None when none is queued.
    """
    query = select(Job.id).where(
        Job.kind == SPINE_JOB, Job.subject_id == surgery_id, Job.state == JobState.QUEUED
    )
    return session.scalars(query.with_for_update()).first()


def latest_state(session: Session, surgery_id: str) -> str:
    """Return the state of the latest job that computes the spines of a surgery.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    str
        The state, or "not submitted" when there is no such job.
    """
    query = select(Job.state).where(Job.kind == SPINE_JOB, Job.subject_id == surgery_id)
    state = session.scalars(query.order_by(Job.created_at.desc(), Job.id).limit(1)).first()
    return "not submitted" if state is None else state.value


def _new(session: Session, surgery_id: str, now: datetime) -> str:
    return jobs.add(session, SPINE_JOB, surgery_id, now, {"surgery_id": surgery_id}).id
