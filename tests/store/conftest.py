from collections.abc import Iterator
from pathlib import Path

import pytest

from migrations.history import upgrade
from store.database import Database


@pytest.fixture
def record(tmp_path: Path) -> Iterator[Database]:
    url = f"sqlite:///{tmp_path / 'record.sqlite'}"
    upgrade(url)
    record = Database(url)
    yield record
    record.close()
