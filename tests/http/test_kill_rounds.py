"""Rounds of kill -9 of any process of ``spinewatch run`` under load: nothing is lost, doubled or different."""

from pathlib import Path

import pytest

from bench import load_kills
from bench.load_service import LoadService
from tests.backends import new_database, new_queue

_ROUNDS = 20


@pytest.mark.timeout(3600)
# a connection whose server was killed in the middle of an answer is closed only when its object goes
@pytest.mark.filterwarnings("default::pytest.PytestUnraisableExceptionWarning")
def test_nothing_is_lost_doubled_or_different_after_kills(tmp_path: Path) -> None:
    with (
        new_database(tmp_path, tables=False, name="spinewatch") as database,
        new_queue(tmp_path, database) as queue,
        LoadService(tmp_path, database_url=database, queue_url=queue) as service,
    ):
        found = load_kills.run(service, _ROUNDS, seed=1)
    assert found.ledger.is_exactly_once, found.ledger.text
    assert found.ledger.expected == _ROUNDS * load_kills.CARTS * load_kills.STAGES
    assert not found.failed
    assert found.differing == 0
    assert found.killed
