"""Surgeries in the record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload

from store import events
from store.errors import NotFoundError
from store.page import Page, page_of
from store.tables import Stage, Surgery


@dataclass(frozen=True)
class NewSurgery:
    """What is known of a surgery before its first stage."""

    reference: str
    vertebrae: Sequence[str]
    reference_vertebra: str
    spine_axis: str


def add(session: Session, new: NewSurgery, now: datetime) -> Surgery:
    """Add a surgery without stages."""
    row = Surgery(
        id=str(uuid4()),
        reference=new.reference,
        vertebrae=list(new.vertebrae),
        reference_vertebra=new.reference_vertebra,
        spine_axis=new.spine_axis,
        created_at=now,
        stages=[],
    )
    session.add(row)
    events.append(session, now, events.Action.SURGERY_CREATED, row.id, row.id)
    return row


def get(session: Session, surgery_id: str) -> Surgery:
    """Return a surgery without its stages; raise ``NotFoundError``."""
    row = session.get(Surgery, surgery_id)
    if row is None:
        raise NotFoundError("surgery")
    return row


def get_with_stages(session: Session, surgery_id: str) -> Surgery:
    """Return a surgery with every take of its stages and their jobs; raise ``NotFoundError``."""
    query = select(Surgery).where(Surgery.id == surgery_id).options(*_WITH_STAGES)
    row = session.scalars(query).one_or_none()
    if row is None:
        raise NotFoundError("surgery")
    return row


def listed(session: Session, limit: int, offset: int) -> Page[Surgery]:
    """Return a page of surgeries with their stages, oldest first."""
    query = select(Surgery).order_by(Surgery.created_at, Surgery.id).options(*_WITH_STAGES)
    return page_of(session, query, limit, offset)


_WITH_STAGES = (selectinload(Surgery.stages).options(joinedload(Stage.job)),)
