from collections.abc import Iterator
from pathlib import Path

import pytest

from store.database import Database
from tests.backends import new_database, require_postgresql
from tests.store.builders import new_stage, new_surgery


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with new_database(tmp_path) as url:
        database = Database(url)
        yield database
        database.close()


@pytest.fixture
def postgresql() -> None:
    require_postgresql()


@pytest.fixture
def job(database: Database) -> str:
    """Return the job of a new stage."""
    return new_stage(database, new_surgery(database)).job.id
