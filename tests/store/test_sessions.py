from datetime import timedelta

import pytest

from contract.key import NewKey, Scope
from store import keys, sessions
from store.database import Database
from store.tables.access import ApiKey, ApiSession
from tests.store.builders import CLIENT, at

HOUR = timedelta(hours=1)


def key_of(database: Database, expires_in_days: int | None = None) -> ApiKey:
    new = NewKey(name="dashboard", scopes=[Scope.STAGE_READ], expires_in_days=expires_in_days)
    with database.write() as session:
        return keys.add(session, new, at(0), CLIENT)[0]


def started(database: Database, key: ApiKey, second: float = 0.0, duration: timedelta = HOUR) -> str:
    with database.write() as session:
        return sessions.start(session, key, at(second), duration, CLIENT)[1]


def found(database: Database, token: str, second: float = 0.0) -> ApiSession | None:
    with database.read() as session:
        return sessions.find(session, token, at(second))


def test_a_session_has_the_key_and_not_its_token(database: Database) -> None:
    key = key_of(database)
    token = started(database, key)
    row = found(database, token)
    assert row is not None
    assert row.key.prefix == key.prefix
    assert token not in {str(value) for value in vars(row).values()}
    assert row.token_sha256 == keys.digest(token)


@pytest.mark.parametrize("token", ["", "x", "a" * 1000, "\N{SNOWMAN}"])
def test_another_token_is_unknown(database: Database, token: str) -> None:
    started(database, key_of(database))
    assert found(database, token) is None


def test_a_session_ends_by_time(database: Database) -> None:
    token = started(database, key_of(database))
    assert found(database, token, 3599) is not None
    assert found(database, token, 3600) is None


def test_a_session_ends_with_its_key(database: Database) -> None:
    key = key_of(database, expires_in_days=1)
    token = started(database, key, duration=timedelta(days=7))
    assert found(database, token, 86399) is not None
    assert found(database, token, 86400) is None
    token = started(database, key)
    with database.write() as session:
        keys.revoke(session, key.prefix, at(1), CLIENT)
    assert found(database, token, 2) is None


def test_a_session_can_be_ended(database: Database) -> None:
    key = key_of(database)
    token, other = started(database, key), started(database, key)
    for _ in range(2):
        with database.write() as session:
            sessions.end(session, token, at(1), CLIENT)
    assert found(database, token, 1) is None
    assert found(database, other, 1) is not None


def test_sessions_that_have_ended_are_removed(database: Database) -> None:
    key = key_of(database)
    started(database, key)
    started(database, key, 4000)
    with database.read() as session:
        assert session.query(ApiSession).count() == 1


def test_a_key_has_a_bounded_number_of_sessions(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "MAX_SESSIONS", 3)
    key, other = key_of(database), key_of(database)
    kept = started(database, other)
    tokens = [started(database, key, second) for second in range(5)]
    assert [found(database, token, 5) is not None for token in tokens] == [False, False, True, True, True]
    assert found(database, kept, 5) is not None
