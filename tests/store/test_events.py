from hashlib import sha256

import pytest
from sqlalchemy import select, text
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from contract.event import Actor, ActorKind, Outcome
from store import events
from store.audit import verify_chain
from store.database import Database
from store.tables.events import Event
from tests.backends import about_the_sqlite_file
from tests.store.builders import CLIENT, NOON


def append(session: Session) -> None:
    events.append(session, NOON, CLIENT, events.Action.SURGERY_CREATED, "s")


def test_an_event_has_an_action_and_an_actor(database: Database) -> None:
    actor = Actor(kind=ActorKind.COMMAND, name="spinewatch export")
    with database.write() as session:
        events.append(session, NOON, actor, "export:made", "subject", "surgery")
    with database.read() as session:
        row = session.scalars(select(Event)).one()
    assert (row.action, row.actor_kind, row.actor_name) == ("export:made", "command", "spinewatch export")
    assert (row.subject_id, row.surgery_id, row.at) == ("subject", "surgery", NOON)


@pytest.mark.parametrize("action", events.Action)
def test_an_action_is_a_subject_and_a_verb(action: events.Action) -> None:
    subject, _, verb = action.value.partition(":")
    assert subject.isalpha()
    assert verb.isalpha()


def test_events_are_numbered_and_chained_in_order(database: Database) -> None:
    for count in (1, 2):  # two of them in one transaction
        with database.write() as session:
            for _ in range(count):
                append(session)
    with database.read() as session:
        rows = session.scalars(select(Event).order_by(Event.seq)).all()
    assert [row.seq for row in rows] == [1, 2, 3]
    hashes = [events.FIRST_HASH]
    for row in rows:
        entry = {column.name: getattr(row, column.name) for column in Event.__table__.columns}
        hashes.append(events.chained_hash(hashes[-1], entry))
    assert [row.hash for row in rows] == hashes[1:]
    assert len(set(hashes)) == 4


def test_the_hash_is_that_of_the_published_form() -> None:
    entry = {
        "seq": 1, "at": NOON, "action": "surgery:created", "actor_kind": "http", "actor_name": "cart",
        "actor_key": None, "address": "10.0.0.7", "request_id": None, "outcome": "success", "detail": "\u00e9",
        "surgery_id": "s", "subject_id": "s",
    }  # fmt: skip
    text = (
        '{"action":"surgery:created","actor_key":null,"actor_kind":"http","actor_name":"cart","address":"10.0.0.7",'
        '"at":"2026-11-21T12:00:00.000000+00:00","detail":"\\u00e9","outcome":"success","request_id":null,"seq":1,'
        '"subject_id":"s","surgery_id":"s"}'
    )
    assert events.chained_hash("0" * 64, entry) == sha256(f"{'0' * 64}\n{text}".encode()).hexdigest()


def test_an_event_that_is_rolled_back_leaves_no_gap(database: Database) -> None:
    with database.write() as session:
        append(session)
        session.rollback()
    with database.write() as session:
        append(session)
        part = session.begin_nested()
        append(session)
        part.rollback()
        append(session)
    with database.read() as session:
        assert session.scalars(select(Event.seq).order_by(Event.seq)).all() == [1, 2]
        assert verify_chain(session).is_whole


def test_a_client_and_the_outcome_are_recorded(database: Database) -> None:
    actor = Actor(
        kind=ActorKind.HTTP, name="k3vq7mzd cart 1", key="k3vq7mzd", address="10.0.0.7", request_id="r1"
    )
    with database.write() as session:
        events.append(session, NOON, actor, "x:tried", "x", outcome=Outcome.REFUSED, detail="y" * 1000)
    with database.read() as session:
        row = session.scalars(select(Event)).one()
    assert (row.actor_key, row.address, row.request_id) == ("k3vq7mzd", "10.0.0.7", "r1")
    assert (row.outcome, row.detail) == ("refused", "y" * events.MAX_DETAIL)


@about_the_sqlite_file
@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE events SET actor_name = 'x'",
        "UPDATE events SET hash = hash",
        "DELETE FROM events",
        "INSERT OR REPLACE INTO events SELECT * FROM events WHERE seq = 1",
        "INSERT INTO events SELECT seq + 5, at, action, actor_kind, actor_name, surgery_id, subject_id, actor_key,"
        " address, request_id, outcome, detail, hash FROM events WHERE seq = 1",
    ],
)
def test_the_database_refuses_to_change_events(database: Database, statement: str) -> None:
    with database.write() as session:
        append(session)
        append(session)
    with pytest.raises(IntegrityError), database.write() as session:
        session.execute(text(statement))
    with database.read() as session:
        assert session.scalars(select(Event.seq).order_by(Event.seq)).all() == [1, 2]
