import time
from collections.abc import Callable, Iterator
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from contract.key import NewKey, Scope
from service.key_use import KeyUse
from store import keys
from store.database import Database
from tests.backends import about_the_sqlite_file, new_database
from tests.store.builders import CLIENT, at

PATIENCE_S = 30.0


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with new_database(tmp_path) as url:
        database = Database(url)
        yield database
        database.close()


def prefix_of(database: Database) -> str:
    with database.write() as session:
        return keys.add(session, NewKey(name="cart", scopes=[Scope.STAGE_READ]), at(0), CLIENT)[0].prefix


def last_use(database: Database, prefix: str) -> datetime | None:
    with database.read() as session:
        return keys.get(session, prefix).last_used_at


def eventually(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@about_the_sqlite_file  # others lock rows
def test_a_use_is_stored_without_waiting_for_a_database_that_is_held(database: Database) -> None:
    prefix, use = prefix_of(database), KeyUse(database)
    with database.write() as session:  # holds the write lock
        session.connection()
        use.note(prefix, at(1))
        assert last_use(database, prefix) is None
    eventually(lambda: last_use(database, prefix) == at(1))


def test_uses_within_a_minute_are_noted_once(database: Database) -> None:
    prefix, use = prefix_of(database), KeyUse(database)
    use.note(prefix, at(1))
    eventually(lambda: last_use(database, prefix) == at(1))
    for second in (2, 30, 60.9):
        use.note(prefix, at(second))
    assert use._waiting.qsize() == 0
    use.note(prefix, at(1) + timedelta(minutes=1))
    eventually(lambda: last_use(database, prefix) == at(61))


def test_a_use_of_a_key_that_is_gone_does_not_end_the_thread(database: Database) -> None:
    prefix, use = prefix_of(database), KeyUse(database)
    use.note("aaaaaaaa", at(1))
    use.note(prefix, at(1))
    eventually(lambda: last_use(database, prefix) == at(1))
