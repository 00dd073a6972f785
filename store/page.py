"""Lists come in pages, oldest first, so that a page stays the same while rows are added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from sqlalchemy import Select, func, select
from sqlalchemy.orm import Session

Row = TypeVar("Row")


@dataclass(frozen=True)
class Page(Generic[Row]):
    """A part of a list.

    Attributes
    ----------
    items
        The rows of the page.
    total
        Number of rows in all pages.
    limit
        Largest number of rows in a page.
    offset
        Number of rows before this page.
    """

    items: Sequence[Row]
    total: int
    limit: int
    offset: int


def page_of(session: Session, query: Select[Row], limit: int, offset: int) -> Page[Row]:
    """Return a page of an ordered query.

    Parameters
    ----------
    session
        Session that reads.
    query
        The ordered query.
    limit
        Largest number of rows.
    offset
        Number of rows before the page.

    Returns
    -------
    Page
        The rows and their total number.
    """
    total = session.scalar(select(func.count()).select_from(query.order_by(None).subquery())) or 0
    return Page(session.scalars(query.limit(limit).offset(offset)).all(), total, limit, offset)
