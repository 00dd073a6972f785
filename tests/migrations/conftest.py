from collections.abc import Iterator
from pathlib import Path

import pytest

from migrations.history import upgrade
from store.database import Database


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    url = f"sqlite:///{tmp_path / 'database.sqlite'}"
    upgrade(url)
    database = Database(url)
    yield database
    database.close()
