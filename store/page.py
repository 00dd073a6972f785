"""Lists come in pages, oldest first, so that a page stays what it was while rows are added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

Row = TypeVar("Row")


@dataclass(frozen=True)
class Page(Generic[Row]):
    """A part of a list: ``items`` from ``offset`` on, at most ``limit``, of ``total``."""

    items: Sequence[Row]
    total: int
    limit: int
    offset: int


def page_of(session: Session, query: Select[Row], limit: int, offset: int) -> Page[Row]:
    """Return a page of an ordered query."""
    total = session.scalar(select(func.count()).select_from(query.order_by(None).subquery())) or 0
    return Page(session.scalars(query.limit(limit).offset(offset)).all(), total, limit, offset)
