from datetime import timedelta

import pytest

from contract.key import NewKey, Scope
from store import keys, sessions
from store.admissions import Admission, withdrawn
from store.database import Database
from store.tables.access import ApiKey
from tests.store.builders import CLIENT, at

DAY_S = 86_400


@pytest.fixture
def key(database: Database) -> ApiKey:
    new = NewKey(name="dashboard", scopes=[Scope.STAGE_READ], expires_in_days=1)
    with database.write() as session:
        return keys.add(session, new, at(0), CLIENT)[0]


@pytest.fixture
def by_session(database: Database, key: ApiKey) -> Admission:
    with database.write() as session:
        return Admission(key.prefix, sessions.start(session, key, at(0), timedelta(hours=1), CLIENT)[1])


def ended(database: Database, second: float, *admissions: Admission) -> frozenset[Admission]:
    with database.read() as session:
        return withdrawn(session, admissions, at(second))


def test_nobody_is_asked_for(database: Database) -> None:
    assert ended(database, 0) == frozenset()


def test_a_key_expires_and_its_sessions_with_it(database: Database, by_session: Admission) -> None:
    by_key = Admission(by_session.key_prefix, None)
    assert ended(database, 3599, by_key, by_session) == frozenset()
    assert ended(database, 3600, by_key, by_session) == {by_session}
    assert ended(database, DAY_S, by_key, by_session) == {by_key, by_session}


def test_a_session_that_is_ended_takes_nothing_else_along(database: Database, by_session: Admission) -> None:
    by_key = Admission(by_session.key_prefix, None)
    with database.write() as session:
        sessions.end(session, str(by_session.session_token), at(1), CLIENT)
    assert ended(database, 2, by_key, by_session) == {by_session}


def test_a_revoked_key_takes_its_sessions_along(database: Database, by_session: Admission) -> None:
    by_key = Admission(by_session.key_prefix, None)
    with database.write() as session:
        keys.revoke(session, by_key.key_prefix, at(1), CLIENT)
    assert ended(database, 2, by_key, by_session) == {by_key, by_session}


@pytest.mark.parametrize("token", [None, "x" * 43])
def test_what_is_unknown_is_not_admitted(database: Database, token: str | None) -> None:
    unknown = Admission("unknown", token)
    assert ended(database, 0, unknown) == {unknown}
