"""Rounds of kill -9 of any process of ``spinewatch run`` under load: nothing is lost, doubled or different."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from bench import load_kills
from bench.load_service import LoadService
from tests.backends import new_database, new_queue

_ROUNDS = 20
_SERVICES = 3
"""Services that are killed side by side: a round waits most of the time."""


@contextmanager
def new_service(folder: Path) -> Iterator[LoadService]:
    folder.mkdir()
    with (
        new_database(folder, tables=False, name="spinewatch") as database,
        new_queue(folder, database) as queue,
        LoadService(folder, database_url=database, queue_url=queue) as service,
    ):
        yield service


@pytest.mark.timeout(3600)
# a connection whose server was killed in the middle of an answer is closed only when its object goes
@pytest.mark.filterwarnings("default::pytest.PytestUnraisableExceptionWarning")
def test_nothing_is_lost_doubled_or_different_after_kills(tmp_path: Path) -> None:
    with ExitStack() as stack:
        services = [stack.enter_context(new_service(tmp_path / str(k))) for k in range(_SERVICES)]
        found = load_kills.run(services, _ROUNDS, seed=1)
    assert found.ledger.is_exactly_once, found.ledger.text
    assert found.ledger.expected == _ROUNDS * load_kills.CARTS * load_kills.STAGES
    assert not found.failed
    assert found.differing == 0
    assert found.killed
