import pytest
from sqlalchemy import select, text
from sqlalchemy.orm import Session

from contract.event import Actor, ActorKind
from store import events
from store.database import Database
from store.tables import Event
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


def test_numbers_of_events_are_never_used_twice(database: Database) -> None:
    with database.write() as session:
        append(session)
    with database.write() as session:
        session.execute(text("DELETE FROM events"))
    with database.write() as session:
        append(session)
    with database.read() as session:
        assert session.scalars(select(Event.seq)).all() == [2]
