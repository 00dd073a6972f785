"""Hosts that fail: the count of what is lost, and one experiment on network namespaces where they can be made."""

import os
from pathlib import Path

import pytest

from bench.hosts import EXPERIMENTS, Outcome, grids_and_bars, missing, run

REASON = missing()


def holds(**changes: int | bool) -> list[bool]:
    sound = Outcome("database host killed", sent=20, refused=3, started_again=1, ended_s=4.0)
    for name, value in changes.items():
        setattr(sound, name, value)
    return [bar.holds for bar in grids_and_bars([sound])[1]]


def test_what_is_lost_doubled_different_or_broken_misses_a_bar() -> None:
    assert holds() == [True] * 5
    for number, change in enumerate(("lost", "doubled", "differing", "broken", "restarted")):
        assert holds(**{change: 1}) == [n != number for n in range(5)]


def test_each_kind_of_host_fails_in_each_way() -> None:
    assert {"worker", "database", "queue", "API"} <= {name.split()[0] for name in EXPERIMENTS}
    assert {"back", "killed", "slow"} <= {name.split()[-1] for name in EXPERIMENTS}


@pytest.mark.skipif(REASON is not None, reason=str(REASON))
@pytest.mark.skipif("HOST_EXPERIMENTS" not in os.environ, reason="it waits by time: set HOST_EXPERIMENTS=1")
@pytest.mark.timeout(600)
def test_a_database_host_that_is_killed_loses_and_doubles_nothing(tmp_path: Path) -> None:
    for folder in (tmp_path, *list(tmp_path.parents)[:3]):
        folder.chmod(0o755)  # the database server runs as a user of its own
    (outcome,) = run(["database host killed"], 2, tmp_path)
    assert outcome.sent >= 4
    assert (outcome.lost, outcome.doubled, outcome.differing, outcome.broken) == (0, 0, 0, 0)
    assert not outcome.restarted
