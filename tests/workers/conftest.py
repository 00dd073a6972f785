from collections.abc import Iterator
from pathlib import Path

import pytest

from migrations.history import upgrade
from store.record import Record


@pytest.fixture
def record(tmp_path: Path) -> Iterator[Record]:
    url = f"sqlite:///{tmp_path / 'record.sqlite'}"
    upgrade(url)
    record = Record(url)
    yield record
    record.close()
