from collections.abc import Iterator
from pathlib import Path

import pytest

from store.database import Database
from tests.backends import new_database, require_postgresql
from tests.migrations.version_0_1_0 import fill


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with new_database(tmp_path) as url:
        database = Database(url)
        yield database
        database.close()


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """The URL of a new database without tables."""
    if request.param == "postgresql":
        require_postgresql()
    with new_database(tmp_path, tables=False, name="x", storage=request.param) as url:
        yield url


@pytest.fixture
def empty(url: str) -> Iterator[Database]:
    database = Database(url)
    yield database
    database.close()


@pytest.fixture
def old(empty: Database) -> Database:
    """A database of version 0.1.0 with a row of every kind."""
    fill(empty)
    return empty
