"""Surgeries in the database."""

from __future__ import annotations

from datetime import datetime
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload

from contract.event import Actor
from contract.job import JobState
from contract.surgery import NewSurgery
from store import events, retention
from store.errors import NotFoundError
from store.page import Page, PageRequest, created_within, page_of
from store.tables.jobs import Job
from store.tables.stages import Stage
from store.tables.surgeries import Surgery


def add(session: Session, new: NewSurgery, now: datetime, actor: Actor) -> Surgery:
    """Add a surgery without stages.

    Parameters
    ----------
    session
        Session that writes.
    new
        What is known of it.
    now
        Time of its creation.
    actor
        Who adds it.

    Returns
    -------
    Surgery
        The new row.
    """
    row = Surgery(id=str(uuid4()), **new.model_dump(), created_at=now, stages=[])
    session.add(row)
    events.append(session, now, actor, events.Action.SURGERY_CREATED, row.id, row.id)
    return row


def get(session: Session, surgery_id: str) -> Surgery:
    """Return a surgery without its stages.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    Surgery
        The row.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    SurgeryDeletedError
        It was deleted.
    """
    retention.require_present(session, surgery_id)
    row = session.get(Surgery, surgery_id)
    if row is None:
        raise NotFoundError("surgery")
    return row


def get_with_stages(session: Session, surgery_id: str) -> Surgery:
    """Return a surgery with every take of its stages and their jobs.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    Surgery
        The row.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    SurgeryDeletedError
        It was deleted.
    """
    retention.require_present(session, surgery_id)
    query = select(Surgery).where(Surgery.id == surgery_id).options(*_WITH_STAGES)
    row = session.scalars(query).one_or_none()
    if row is None:
        raise NotFoundError("surgery")
    return row


def listed(
    session: Session,
    wanted: PageRequest,
    *,
    reference: str | None = None,
    state: JobState | None = None,
    calibration_id: str | None = None,
    created_after: datetime | None = None,
    created_before: datetime | None = None,
) -> Page[Surgery]:
    """Return a page of surgeries with their stages.

    Parameters
    ----------
    session
        Session that reads.
    wanted
        Which part of the list.
    reference
        Only those of this case number.
    state
        Only those with a take whose job is in this state.
    calibration_id
        Only those with a take of this calibration.
    created_after, created_before
        Only those created at the first time or later, and before the second one.

    Returns
    -------
    Page of Surgery
        The rows.
    """
    query = created_within(
        select(Surgery).where(retention.is_present()), Surgery, created_after, created_before
    )
    if reference is not None:
        query = query.where(Surgery.reference == reference)
    if state is not None:
        query = query.where(Surgery.stages.any(Stage.job.has(Job.state == state)))
    if calibration_id is not None:
        query = query.where(Surgery.stages.any(Stage.calibration_id == calibration_id))
    return page_of(session, query.options(*_WITH_STAGES), Surgery, wanted)


_WITH_STAGES = (selectinload(Surgery.stages).options(joinedload(Stage.job)),)
