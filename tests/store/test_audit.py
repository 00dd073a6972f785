import sqlite3
from collections.abc import Iterator
from contextlib import closing

import pytest
from sqlalchemy import text

from store import audit, events
from store.audit import check_chain, verify_chain, verify_chain_of
from store.database import Database, sqlite_path
from tests.backends import about_the_sqlite_file
from tests.store.builders import CLIENT, NOON, WORKER, at, claimed, new_stage, new_surgery, succeed


@pytest.fixture
def surgery(database: Database) -> str:
    surgery = new_surgery(database)
    succeed(database, claimed(database, new_stage(database, surgery).job.id))
    return surgery


@pytest.fixture
def unprotected(database: Database, surgery: str) -> Iterator[sqlite3.Connection]:
    """A connection of somebody who has removed the triggers."""
    path = sqlite_path(database.url)
    assert path is not None
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
            connection.execute(f"DROP TRIGGER {name}")
        yield connection


def test_the_chain_of_a_used_database_is_whole(database: Database, surgery: str) -> None:
    with database.read() as session:
        chain = verify_chain(session)
        last = audit.listed(session, 1).items[0]
    assert chain.is_whole
    assert chain.events == chain.last == 5
    assert chain.head == last.hash
    path = sqlite_path(database.url)
    if path is not None:
        with closing(sqlite3.connect(path)) as connection:
            assert verify_chain_of(connection) == chain


def test_a_chain_without_events_is_whole(database: Database) -> None:
    with database.read() as session:
        assert verify_chain(session) == check_chain([]) == audit.Chain(0, 0, events.FIRST_HASH, None, None)


@about_the_sqlite_file
@pytest.mark.parametrize(
    ("statement", "broken_at"),
    [
        ("UPDATE events SET actor_name = 'x' WHERE seq = 2", 2),
        ("UPDATE events SET at = '2026-11-21 13:00:00.000000' WHERE seq = 3", 3),
        ("UPDATE events SET at = 'yesterday' WHERE seq = 3", 3),
        ("UPDATE events SET detail = '' WHERE seq = 4", 4),
        ("UPDATE events SET outcome = 'failed' WHERE seq = 1", 1),
        ("UPDATE events SET hash = '' WHERE seq = 5", 5),
        ("DELETE FROM events WHERE seq = 3", 4),
        ("DELETE FROM events WHERE seq = 1", 2),
        ("DELETE FROM events WHERE seq >= 4", 4),
        ("DELETE FROM events", 1),
        ("DELETE FROM events WHERE seq = 3; UPDATE events SET seq = seq - 1 WHERE seq > 3", 3),
        ("UPDATE events SET seq = 9 WHERE seq = 2; UPDATE events SET seq = 2 WHERE seq = 3;"
         "UPDATE events SET seq = 3 WHERE seq = 9", 2),
    ],
)  # fmt: skip
def test_a_change_breaks_the_chain_where_it_is(
    database: Database, unprotected: sqlite3.Connection, statement: str, broken_at: int
) -> None:
    unprotected.executescript(statement)
    chain = verify_chain_of(unprotected)
    assert chain.broken_at == broken_at
    assert chain.reason is not None
    assert str(broken_at) in chain.reason
    if "yesterday" not in statement:
        with database.read() as session:
            assert verify_chain(session) == chain


def test_the_newest_event_comes_first(database: Database, surgery: str) -> None:
    with database.write() as session:
        events.append(session, at(9), WORKER, "x:done", "x")
    with database.read() as session:
        pages = [audit.listed(session, 4)]
        while (before := pages[-1].next) is not None:
            pages.append(audit.listed(session, 4, before))
        assert [[item.seq for item in page.items] for page in pages] == [[6, 5, 4, 3], [2, 1]]
        assert {page.total for page in pages} == {6}
        of_surgery = audit.listed(session, 50, surgery_id=surgery)
        assert {item.surgery_id for item in of_surgery.items} == {surgery}
        assert [item.seq for item in audit.all_events(session)] == [1, 2, 3, 4, 5, 6]
        assert len(list(audit.all_events(session, surgery))) == of_surgery.total == 4


def test_a_row_becomes_the_contract_model(database: Database) -> None:
    with database.write() as session:
        events.append(session, NOON, CLIENT, "surgery:created", "s", "s")
    with database.read() as session:
        (item,) = audit.listed(session, 1).items
        stored = session.execute(text("SELECT hash FROM events")).scalar_one()
    assert item.model_dump(mode="json") == {
        "seq": 1, "at": "2026-11-21T12:00:00Z", "action": "surgery:created", "resource": "surgery", "subject_id": "s",
        "surgery_id": "s", "actor_kind": "http", "actor_name": "127.0.0.1", "actor_key": None, "address": None,
        "request_id": None, "outcome": "success", "detail": None, "hash": stored,
    }  # fmt: skip
