from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from contract.job import JobState
from store import job_sweep, jobs, leases
from store.database import Database
from store.leases import Lease
from store.queue import JobQueue
from tests.store.builders import CLIENT, LEASE, NOON, WORKER, at, claim, claimed, new_stage, new_surgery
from workers.sweep import Sweep

LEASE_SECONDS = LEASE.total_seconds()


class Clock:
    """A monotonic clock that the test moves."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def __call__(self) -> float:
        return self.seconds


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def queue(tmp_path: Path) -> Iterator[JobQueue]:
    queue = JobQueue(f"sqlite:///{tmp_path / 'queue.sqlite'}")
    yield queue
    queue.close()


@pytest.fixture
def sweep(database: Database, queue: JobQueue, clock: Clock) -> Sweep:
    return Sweep(database, queue, LEASE_SECONDS, clock)


def beat(database: Database, lease: Lease, second: float) -> bool:
    with database.write() as session:
        return leases.heartbeat(session, lease, at(second) + LEASE, 0.5, "match")


def test_a_job_whose_message_was_lost_is_enqueued_once(
    database: Database, queue: JobQueue, sweep: Sweep, clock: Clock
) -> None:
    job = new_stage(database, new_surgery(database)).job.id
    counts = []
    for clock.seconds in (0, 1, 2, 2.5, 10):
        counts.append(sweep())
    assert counts == [0, 0, 1, 0, 0]
    assert queue.waiting() == {job}


def test_of_two_sweeps_one_enqueues_a_job(database: Database, queue: JobQueue, clock: Clock) -> None:
    new_stage(database, new_surgery(database))
    sweeps = [Sweep(database, queue, LEASE_SECONDS, clock) for _ in range(2)]
    for clock.seconds in (0, 2, 2.1):
        for sweep in sweeps:
            sweep()
    assert queue.length() == 1


def test_a_backlog_does_not_multiply(database: Database, queue: JobQueue, sweep: Sweep, clock: Clock) -> None:
    surgery = new_surgery(database)
    for number in range(5):
        queue.enqueue(new_stage(database, surgery, f"S{number}").job.id)
    for clock.seconds in range(0, 100, 10):
        assert sweep() == 0
    assert queue.length() == 5


def test_a_job_that_was_overtaken_on_another_s_message_needs_no_message_of_its_own(
    database: Database, queue: JobQueue, sweep: Sweep, clock: Clock
) -> None:
    surgery = new_surgery(database)
    first, second = (new_stage(database, surgery, name).job.id for name in ("PRE", "POST"))
    queue.enqueue(second)
    claimed(database, second)
    for clock.seconds in (0, 3):
        sweep()
    assert queue.waiting() == {second}  # one message, which starts the first job
    assert first not in queue.waiting()


def test_the_lease_of_a_silent_worker_ends(
    database: Database, queue: JobQueue, sweep: Sweep, clock: Clock
) -> None:
    job = new_stage(database, new_surgery(database)).job.id
    first = claimed(database, job)
    sweep()
    clock.seconds = LEASE_SECONDS - 0.1
    assert sweep() == 0
    assert claim(database, job, 100) is None
    clock.seconds = LEASE_SECONDS
    assert sweep() == 1
    assert queue.waiting() == {job}
    second = claimed(database, job, 100)
    assert (second.attempt, second.owner != first.owner) == (1, True)


def test_heartbeats_keep_a_lease(database: Database, sweep: Sweep, clock: Clock) -> None:
    job = new_stage(database, new_surgery(database)).job.id
    lease = claimed(database, job)
    for clock.seconds in range(0, 60, 4):
        assert sweep() == 0
        assert beat(database, lease, clock.seconds)
    assert claim(database, job, 60) is None


@pytest.mark.parametrize("set_by", [timedelta(hours=-1), timedelta(hours=1)])
def test_a_clock_that_is_set_delays_and_doubles_nothing(
    database: Database, queue: JobQueue, sweep: Sweep, clock: Clock, set_by: timedelta
) -> None:
    wall = set_by.total_seconds()
    surgery = new_surgery(database)
    beating, dead, lost = (
        new_stage(database, surgery, name, now=at(n)).job.id for n, name in enumerate("ABC")
    )
    alive = claimed(database, beating)
    claimed(database, dead)
    for clock.seconds in (0, 1, 2):
        sweep()
    assert queue.waiting() == {lost}
    for clock.seconds in (3, 4, 5):
        beat(database, alive, wall + clock.seconds)
        sweep()
    with database.read() as session:
        states = {job.id: job.claimable for job in job_sweep.unended(session)}
    assert states == {beating: False, dead: True, lost: True}
    assert claim(database, beating, wall + 6) is None
    with database.write() as session:
        next_one = leases.claim_next(session, NOON + set_by, LEASE, 3, WORKER)
    assert next_one is not None
    assert next_one.job_id == dead


def test_time_in_which_nobody_could_write_does_not_count(
    database: Database, queue: JobQueue, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = new_stage(database, new_surgery(database)).job.id
    claimed(database, job)

    class Slow(Database):
        def write(self, **options: Any) -> Any:
            clock.seconds += 8  # another process held the database
            return super().write(**options)

    slow = Slow(database.url)
    sweep = Sweep(slow, queue, LEASE_SECONDS, clock)
    sweep()
    clock.seconds = 6
    assert sweep() == 0
    assert claim(database, job, 100) is None
    slow.close()


def test_a_job_that_has_ended_is_not_enqueued(
    database: Database, queue: JobQueue, sweep: Sweep, clock: Clock
) -> None:
    job = new_stage(database, new_surgery(database)).job.id
    sweep()
    with database.write() as session:
        jobs.cancel(session, job, at(1), CLIENT)
    clock.seconds = 100
    assert sweep() == 0
    assert queue.waiting() == set()


def test_a_lease_that_expired_and_beats_again_is_held(database: Database, sweep: Sweep, clock: Clock) -> None:
    job = new_stage(database, new_surgery(database)).job.id
    lease = claimed(database, job)
    for clock.seconds in (0, 6):
        sweep()
    assert beat(database, lease, 6)
    assert claim(database, job, 7) is None
    with database.read() as session:
        assert jobs.get(session, job).state is JobState.RUNNING
