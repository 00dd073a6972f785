from datetime import timedelta

import pytest
from sqlalchemy import select, update

from store import processes
from store.database import Database
from store.processes import MISSED_AFTER, ProcessKind
from store.tables.processes import Process


def report(database: Database, name: str, kind: ProcessKind = ProcessKind.WORKER) -> None:
    with database.write() as session:
        processes.report(session, name, kind, f"host:{name}")


def alive(database: Database, kind: ProcessKind = ProcessKind.WORKER) -> list[str]:
    with database.read() as session:
        return [process.id for process in processes.alive(session, kind)]


def age(database: Database, name: str, by: timedelta) -> None:
    with database.write() as session:
        row = session.get_one(Process, name)
        session.execute(update(Process).where(Process.id == name).values(last_seen=row.last_seen - by))


def test_a_process_is_alive_while_it_reports(database: Database) -> None:
    assert alive(database) == []
    report(database, "a")
    report(database, "b")
    report(database, "s", ProcessKind.SERVER)
    assert alive(database) == ["a", "b"]
    assert alive(database, ProcessKind.SERVER) == ["s"]
    age(database, "a", MISSED_AFTER + timedelta(seconds=1))
    assert alive(database) == ["b"]
    report(database, "a")
    assert alive(database) == ["a", "b"]


def test_a_report_keeps_the_start(database: Database) -> None:
    report(database, "a")
    with database.read() as session:
        first = session.get_one(Process, "a")
    report(database, "a")
    with database.read() as session:
        second = session.get_one(Process, "a")
    assert (second.started_at, second.name) == (first.started_at, "host:a")
    assert second.last_seen > first.last_seen


def test_a_process_that_ends_in_order_is_forgotten(database: Database) -> None:
    report(database, "a")
    with database.write() as session:
        processes.forget(session, "a")
    assert alive(database) == []


@pytest.mark.parametrize(("days", "kept"), [(0.9, True), (1.1, False)])
def test_one_that_has_been_missed_for_a_day_is_deleted(database: Database, days: float, kept: bool) -> None:
    report(database, "old")
    age(database, "old", timedelta(days=days))
    report(database, "new")
    with database.read() as session:
        assert set(session.scalars(select(Process.id))) == ({"old", "new"} if kept else {"new"})
