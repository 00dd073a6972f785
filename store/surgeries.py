"""Surgeries in the database."""

from __future__ import annotations

from datetime import datetime
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload

from contract.event import Actor
from contract.surgery import NewSurgery
from store import events
from store.errors import NotFoundError
from store.page import Page, page_of
from store.tables import Stage, Surgery


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
    """
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
    """
    query = select(Surgery).where(Surgery.id == surgery_id).options(*_WITH_STAGES)
    row = session.scalars(query).one_or_none()
    if row is None:
        raise NotFoundError("surgery")
    return row


def listed(session: Session, limit: int, offset: int) -> Page[Surgery]:
    """Return a page of surgeries with their stages, oldest first.

    Parameters
    ----------
    session
        Session that reads.
    limit
        Largest number of surgeries.
    offset
        Number of surgeries before the page.

    Returns
    -------
    Page of Surgery
        The rows.
    """
    query = select(Surgery).order_by(Surgery.created_at, Surgery.id).options(*_WITH_STAGES)
    return page_of(session, query, limit, offset)


_WITH_STAGES = (selectinload(Surgery.stages).options(joinedload(Stage.job)),)
