import hashlib
from datetime import timedelta

import pytest
from sqlalchemy import select

from contract.key import NewKey, Scope
from store import keys
from store.database import Database
from store.errors import NotFoundError
from store.page import PageRequest
from store.tables.access import ApiKey
from store.tables.events import Event
from tests.store.builders import CLIENT, at

NEW = NewKey(name="cart 1", scopes=[Scope.CAPTURE_WRITE, Scope.STAGE_READ])


def made(database: Database, new: NewKey = NEW, second: float = 0.0) -> tuple[str, str]:
    """Make a key; return its prefix and the whole of it."""
    with database.write() as session:
        row, key = keys.add(session, new, at(second), CLIENT)
        return row.prefix, key


def found(database: Database, key: str, second: float = 0.0) -> ApiKey | None:
    with database.read() as session:
        return keys.authenticate(session, key, at(second))


def test_only_the_sha256_of_a_key_is_stored(database: Database) -> None:
    prefix, key = made(database)
    assert key.startswith(f"sw_{prefix}_")
    row = found(database, key)
    assert row is not None
    assert row.key_sha256 == hashlib.sha256(key.encode()).hexdigest()
    assert (row.name, row.scopes) == ("cart 1", ["capture:write", "stage:read"])
    secret = key.rpartition("_")[2]
    assert not any(secret in str(value) for value in vars(row).values())
    assert len(secret) * 5 >= 256


def test_keys_differ(database: Database) -> None:
    assert len({made(database) for _ in range(20)}) == 20


@pytest.mark.parametrize(
    "change",
    [
        lambda key: key[:-1] + ("a" if key[-1] != "a" else "b"),
        lambda key: key[:3] + ("a" if key[3] != "a" else "b") + key[4:],
        lambda key: key.upper(),
        lambda key: key[:-1],
        lambda key: key + "a",
        lambda key: "",
        lambda key: "sw__",
        lambda key: "\N{SNOWMAN}",
        lambda key: key.replace("sw_", "sw-"),
    ],
)
def test_anything_but_the_whole_key_is_unknown(database: Database, change: object) -> None:
    _, key = made(database)
    assert found(database, key) is not None
    assert found(database, change(key)) is None  # type: ignore[operator]


def test_an_expired_key_is_refused_from_that_moment(database: Database) -> None:
    _, key = made(database, NewKey(name="guest", scopes=[Scope.STAGE_READ], expires_in_days=1))
    day = timedelta(days=1).total_seconds()
    assert found(database, key, day - 1) is not None
    assert found(database, key, day) is None


def test_a_revoked_key_is_refused_and_stays_in_the_list(database: Database) -> None:
    prefix, key = made(database)
    for second in (1, 2):
        with database.write() as session:
            assert keys.revoke(session, prefix, at(second), CLIENT).revoked_at == at(1)
    assert found(database, key, 3) is None
    with database.read() as session:
        page = keys.listed(session, PageRequest())
        actions = session.scalars(select(Event.action).where(Event.subject_id == prefix)).all()
    assert [row.prefix for row in page.items] == [prefix]
    assert actions == ["key:created", "key:revoked"]


def test_an_unknown_key_is_named_as_such(database: Database) -> None:
    with database.write() as session, pytest.raises(NotFoundError, match="no such key"):
        keys.revoke(session, "aaaaaaaa", at(0), CLIENT)


def test_whether_any_key_is_valid(database: Database) -> None:
    def valid(second: float) -> bool:
        with database.read() as session:
            return keys.any_valid(session, at(second))

    assert not valid(0)
    prefix, _ = made(database)
    assert valid(0)
    with database.write() as session:
        keys.revoke(session, prefix, at(1), CLIENT)
    assert not valid(1)
    made(database, NewKey(name="guest", scopes=[Scope.STAGE_READ], expires_in_days=1))
    assert valid(1)
    assert not valid(timedelta(days=2).total_seconds())


def test_a_use_is_stored_at_most_once_a_minute(database: Database) -> None:
    prefix, _ = made(database)
    stored = []
    for second in (5, 30, 64, 65, 66, 200):
        with database.write() as session:
            keys.store_use(session, prefix, at(second))
        with database.read() as session:
            stored.append(keys.get(session, prefix).last_used_at)
    assert stored == [at(5), at(5), at(5), at(65), at(65), at(200)]
