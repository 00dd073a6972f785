"""Processes that run: each reports from time to time, so that one that ended or hangs is missed."""

from __future__ import annotations

from datetime import datetime, timedelta
from enum import StrEnum

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from store.clock import utc_now
from store.tables.processes import Process

REPORT_SECONDS = 2.0
"""Time between two reports of a process."""

MISSED_AFTER = timedelta(seconds=10)
"""Time without a report after which a process is missed."""

_FORGOTTEN_AFTER = timedelta(days=1)


class ProcessKind(StrEnum):
    """What a process does."""

    SERVER = "server"
    WORKER = "worker"


def report(session: Session, process_id: str, kind: ProcessKind, name: str) -> None:
    """Store that a process runs; those that have been missed for a day are deleted.

    Parameters
    ----------
    session
        Session that writes.
    process_id
        UUID of this run of the process.
    kind
        What it does.
    name
        Its host and number.
    """
    now = database_time(session)
    process = session.get(Process, process_id)
    if process is not None:
        process.last_seen = now
        return
    session.execute(delete(Process).where(Process.last_seen < now - _FORGOTTEN_AFTER))
    session.add(Process(id=process_id, kind=kind.value, name=name, started_at=now, last_seen=now))


def forget(session: Session, process_id: str) -> None:
    """Store that a process has ended in order.

    Parameters
    ----------
    session
        Session that writes.
    process_id
        UUID of this run of the process.
    """
    session.execute(delete(Process).where(Process.id == process_id))


def alive(session: Session, kind: ProcessKind) -> list[Process]:
    """Return the processes that reported recently.

    A report from the future, which a clock that was set back leaves behind, counts until the process reports again.

    Parameters
    ----------
    session
        Session that reads.
    kind
        What they do.

    Returns
    -------
    list of Process
        The rows, the oldest process first.
    """
    recent = Process.last_seen >= database_time(session) - MISSED_AFTER
    query = select(Process).where(Process.kind == kind.value, recent)
    return list(session.scalars(query.order_by(Process.started_at, Process.id)))


def database_time(session: Session) -> datetime:
    """Return the time by the clock of the database, which all hosts share.

    Parameters
    ----------
    session
        Any session.

    Returns
    -------
    datetime
        Aware; on SQLite, which runs in this process, the time of this machine.
    """
    if session.get_bind().dialect.name == "sqlite":
        return utc_now()
    now: datetime = session.scalars(select(func.clock_timestamp())).one()
    return now
