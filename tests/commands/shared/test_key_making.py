from collections.abc import Iterator
from pathlib import Path

import pytest

from commands.shared.key_making import has_valid_key, make_first_key, temporary_key
from contract.key import Scope
from settings import Settings
from store import keys
from store.clock import utc_now
from store.database import Database
from store.tables.access import ApiKey
from tests.backends import new_database


@pytest.fixture
def settings(tmp_path: Path) -> Iterator[Settings]:
    with new_database(tmp_path) as url:
        yield Settings(database_url=url)


def valid(settings: Settings, key: str) -> ApiKey | None:
    database = Database(settings.database_url)
    try:
        with database.read() as session:
            return keys.authenticate(session, key, utc_now())
    finally:
        database.close()


def test_a_first_key_is_made_once(settings: Settings) -> None:
    first = make_first_key(settings)
    assert first is not None
    row = valid(settings, first)
    assert row is not None
    assert (row.name, row.scopes, row.expires_at) == ("first key", [Scope.ADMIN], None)
    assert make_first_key(settings) is None


def test_no_key_is_made_for_a_network(settings: Settings) -> None:
    assert make_first_key(settings.model_copy(update={"host": "192.0.2.1"})) is None
    assert not has_valid_key(settings.database_url)


def test_a_temporary_key_ends_with_its_use(settings: Settings) -> None:
    with temporary_key(settings.database_url, "sample") as key:
        row = valid(settings, key)
        assert row is not None
        assert row.expires_at is not None
        assert make_first_key(settings) is None
    assert valid(settings, key) is None
    assert make_first_key(settings) is not None
