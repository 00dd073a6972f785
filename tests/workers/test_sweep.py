from collections.abc import Iterator
from pathlib import Path

import pytest

from store import jobs
from store.database import Database
from store.queue import JobQueue
from tests.store.builders import CLIENT, at, claimed, new_stage, new_surgery
from workers.sweep import sweep


@pytest.fixture
def queue(tmp_path: Path) -> Iterator[JobQueue]:
    queue = JobQueue(f"sqlite:///{tmp_path / 'queue.sqlite'}")
    yield queue
    queue.close()


def test_a_job_whose_message_was_lost_is_enqueued_once(database: Database, queue: JobQueue) -> None:
    job = new_stage(database, new_surgery(database), now=at(0)).job.id
    assert sweep(database, queue, at(1)) == 0
    assert sweep(database, queue, at(3)) == 1
    assert queue.waiting() == {job}
    assert sweep(database, queue, at(3.5)) == 0


def test_a_backlog_does_not_multiply(database: Database, queue: JobQueue) -> None:
    surgery = new_surgery(database)
    for number in range(5):
        queue.enqueue(new_stage(database, surgery, f"S{number}", now=at(0)).job.id)
    for second in range(10, 100, 10):
        assert sweep(database, queue, at(second)) == 0
    assert queue.huey.pending_count() == 5


def test_a_job_whose_worker_died_is_enqueued(database: Database, queue: JobQueue) -> None:
    claimed(database, new_stage(database, new_surgery(database), now=at(0)).job.id)
    assert sweep(database, queue, at(4)) == 0
    assert sweep(database, queue, at(6)) == 1


def test_a_job_that_has_ended_is_not_enqueued(database: Database, queue: JobQueue) -> None:
    job = new_stage(database, new_surgery(database), now=at(0)).job.id
    with database.write() as session:
        jobs.cancel(session, job, at(1), CLIENT)
    assert sweep(database, queue, at(100)) == 0
    assert queue.waiting() == set()
