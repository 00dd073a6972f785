"""Lists come in pages that go on after the last row of the page before: added rows neither repeat nor hide others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Generic, TypeVar

from sqlalchemy import Select, and_, func, inspect, or_, select
from sqlalchemy.orm import InstrumentedAttribute, Session

Row = TypeVar("Row")


@dataclass(frozen=True)
class Position:
    """The place of a row in a list.

    Attributes
    ----------
    value
        What the list is sorted by.
    id
        Identifier of the row, which decides between rows of the same value.
    """

    value: datetime | str
    id: str


@dataclass(frozen=True)
class PageRequest:
    """Which part of a list is wanted.

    Attributes
    ----------
    limit
        Largest number of rows.
    sort
        Name of the column that the list is sorted by, after a minus sign for descending order.
    after
        Position of the last row of the page before; None for the first page.
    """

    limit: int = 50
    sort: str = "-created_at"
    after: Position | None = None


@dataclass(frozen=True)
class Page(Generic[Row]):
    """A part of a list.

    Attributes
    ----------
    items
        The rows of the page.
    total
        Number of rows in all pages.
    next
        Position of the last row when more follow, None at the end of the list.
    """

    items: Sequence[Row]
    total: int
    next: Position | None


def page_of(session: Session, query: Select[Row], table: type[Row], wanted: PageRequest) -> Page[Row]:
    """Return a page of a query.

    Parameters
    ----------
    session
        Session that reads.
    query
        The query of rows of one table, without an order.
    table
        The table, which has one column as its key.
    wanted
        The part of the list.

    Returns
    -------
    Page
        The rows and their total number.
    """
    name, descending = wanted.sort.removeprefix("-"), wanted.sort.startswith("-")
    column: InstrumentedAttribute[Any] = getattr(table, name)
    key_name = inspect(table).primary_key[0].name
    key: InstrumentedAttribute[Any] = getattr(table, key_name)
    total = session.scalar(select(func.count()).select_from(query.with_only_columns(key).subquery())) or 0
    order = (column.desc(), key.desc()) if descending else (column, key)
    following = query.order_by(*order)
    if wanted.after is not None:
        value, last = wanted.after.value, wanted.after.id
        further = column < value if descending else column > value
        beyond = key < last if descending else key > last
        following = following.where(or_(further, and_(column == value, beyond)))
    rows = session.scalars(following.limit(wanted.limit + 1)).all()
    items = rows[: wanted.limit]
    more = len(rows) > len(items)
    after = Position(getattr(items[-1], name), getattr(items[-1], key_name)) if more else None
    return Page(items, total, after)


def page_of_items(
    items: Sequence[Row], position: Callable[[Row], Position], wanted: PageRequest
) -> Page[Row]:
    """Return a page of a short list that is in memory.

    Parameters
    ----------
    items
        The whole list in its order.
    position
        Position of an item.
    wanted
        The part of the list.

    Returns
    -------
    Page
        The items and their total number.
    """
    places = [position(item) for item in items]
    first = (
        0
        if wanted.after is None
        else places.index(wanted.after) + 1
        if wanted.after in places
        else len(items)
    )
    end = first + wanted.limit
    more = end < len(items)
    return Page(items[first:end], len(items), places[end - 1] if more else None)


def created_within(
    query: Select[Row], table: type[Row], after: datetime | None, before: datetime | None
) -> Select[Row]:
    """Return a query restricted to rows that were created in a range of time.

    Parameters
    ----------
    query
        The query.
    table
        Its table, whose rows have ``created_at``.
    after
        Start of the range, included; None without one.
    before
        End of the range, excluded; None without one.

    Returns
    -------
    Select
        The query.
    """
    column: InstrumentedAttribute[datetime] = table.created_at  # type: ignore[attr-defined]
    if after is not None:
        query = query.where(column >= after)
    return query if before is None else query.where(column < before)
