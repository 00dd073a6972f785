"""The audit in the database: pages of events, and whether their chain is whole."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Select, func, select, text
from sqlalchemy.orm import Session

from contract.audit import AuditEvent
from store.events import FIRST_HASH, chained_hash
from store.tables.events import Event

_BATCH = 1000


@dataclass(frozen=True)
class Chain:
    """The chain of events as it was found.

    Attributes
    ----------
    events
        Number of events, up to the break if there is one.
    last
        Number of the last event of them, 0 without any.
    head
        Hash of that event: whoever keeps it can tell later whether any event up to it was changed.
    broken_at
        Number of the first event that does not fit, None when the chain is whole.
    reason
        What is wrong there, None when the chain is whole.
    """

    events: int
    last: int
    head: str
    broken_at: int | None
    reason: str | None

    @property
    def is_whole(self) -> bool:
        """Whether every event fits to the one before."""
        return self.broken_at is None


@dataclass(frozen=True)
class AuditPage:
    """A part of the audit.

    Attributes
    ----------
    items
        The events of the page, newest first.
    total
        Number of events in all pages.
    next
        Number of the last event when older ones follow, None at the end.
    """

    items: Sequence[AuditEvent]
    total: int
    next: int | None


def verify_chain(session: Session) -> Chain:
    """Check the chain of all events of a database.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    Chain
        Whole, or broken at an event.
    """
    on_sqlite = session.get_bind().dialect.name == "sqlite"
    used = session.scalar(text(_USED)) if on_sqlite else None
    columns = list(Event.__table__.columns)
    rows = session.execute(
        select(*columns).order_by(Event.seq).execution_options(yield_per=_BATCH)
    ).mappings()
    return check_chain(rows, used)


def verify_chain_of(connection: sqlite3.Connection) -> Chain:
    """Check the chain of an SQLite file, also of one that nothing may be written to.

    Parameters
    ----------
    connection
        Connection that reads.

    Returns
    -------
    Chain
        Whole, or broken at an event.
    """
    used = connection.execute(_USED).fetchone()
    cursor = connection.execute("SELECT * FROM events ORDER BY seq")
    names = [description[0] for description in cursor.description]
    rows = (dict(zip(names, row, strict=True)) for row in cursor)
    return check_chain(({**row, "at": _moment(row["at"])} for row in rows), None if used is None else used[0])


def check_chain(rows: Iterable[Mapping[Any, Any]], used: int | None = None) -> Chain:
    """Check a chain of events.

    Parameters
    ----------
    rows
        Columns of every event by name, in order.
    used
        Largest number that was ever given to an event; None when unknown.

    Returns
    -------
    Chain
        Whole, or broken at an event. Events that are missing at the end are noticed only by ``used``, or by a hash that
        was kept elsewhere.
    """
    count, last, head = 0, 0, FIRST_HASH
    for row in rows:
        seq = row["seq"]
        try:
            fits = chained_hash(head, row) == row["hash"]
        except (AttributeError, KeyError, TypeError):
            fits = False
        if not fits:
            reason = f"event {seq} was changed, put in, or events before it were removed"
            return Chain(count, last, head, seq, reason)
        count, last, head = count + 1, seq, row["hash"]
    if used is not None and used > last:
        return Chain(count, last, head, last + 1, f"events {last + 1} to {used} are missing at the end")
    return Chain(count, last, head, None, None)


def listed(
    session: Session, limit: int, before: int | None = None, surgery_id: str | None = None
) -> AuditPage:
    """Return a page of the audit, newest event first.

    Parameters
    ----------
    session
        Session that reads.
    limit
        Largest number of events.
    before
        Number of the last event of the page before; None for the first page.
    surgery_id
        Only events of this surgery; None for all.

    Returns
    -------
    AuditPage
        The events.
    """
    query = _of(surgery_id)
    total = session.scalar(select(func.count()).select_from(query.subquery())) or 0
    if before is not None:
        query = query.where(Event.seq < before)
    rows = session.scalars(query.order_by(Event.seq.desc()).limit(limit + 1)).all()
    items = [event_of(row) for row in rows[:limit]]
    return AuditPage(items, total, items[-1].seq if len(rows) > limit else None)


def all_events(session: Session, surgery_id: str | None = None) -> Iterable[AuditEvent]:
    """Return every event in order.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Only events of this surgery; None for all.

    Returns
    -------
    iterable of AuditEvent
        The events, read from the database as they are asked for.
    """
    query = _of(surgery_id).order_by(Event.seq).execution_options(yield_per=_BATCH)
    return (event_of(row) for row in session.scalars(query))


def event_of(row: Event) -> AuditEvent:
    """Return the contract model of an event.

    Parameters
    ----------
    row
        The row.

    Returns
    -------
    AuditEvent
        The model.
    """
    columns = {column.name: getattr(row, column.name) for column in Event.__table__.columns}
    return AuditEvent(**columns, resource=row.action.partition(":")[0])


_USED = "SELECT seq FROM sqlite_sequence WHERE name = 'events'"


def _of(surgery_id: str | None) -> Select[Event]:
    query = select(Event)
    return query if surgery_id is None else query.where(Event.surgery_id == surgery_id)


def _moment(stored: object) -> datetime | None:
    try:
        return datetime.fromisoformat(str(stored))
    except ValueError:
        return None
