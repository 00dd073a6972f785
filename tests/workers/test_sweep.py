from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path

import pytest

from store import jobs
from store.database import Database
from store.queue import JobQueue
from tests.store.builders import at, new_stage, new_surgery
from workers.sweep import sweep


@pytest.fixture
def bell(tmp_path: Path) -> Iterator[JobQueue]:
    bell = JobQueue(tmp_path / "bell.sqlite")
    yield bell
    bell.close()


def test_a_job_without_a_ring_is_rung_once_by_whoever_comes_first(record: Database, bell: JobQueue) -> None:
    job = new_stage(record, new_surgery(record), now=at(0)).job.id
    assert sweep(record, bell, at(1)) == 0
    assert sweep(record, bell, at(3)) == 1
    assert bell.waiting() == {job}
    assert sweep(record, bell, at(3.5)) == 0


def test_a_backlog_does_not_multiply(record: Database, bell: JobQueue) -> None:
    surgery = new_surgery(record)
    for number in range(5):
        bell.ring(new_stage(record, surgery, f"S{number}", now=at(0)).job.id)
    for second in range(10, 100, 10):
        assert sweep(record, bell, at(second)) == 0
    assert bell.huey.pending_count() == 5


def test_a_job_whose_worker_is_gone_is_rung(record: Database, bell: JobQueue) -> None:
    job = new_stage(record, new_surgery(record), now=at(0)).job.id
    with record.writing() as session:
        assert jobs.claim(session, job, at(0), timedelta(seconds=5), 3) is not None
    assert sweep(record, bell, at(4)) == 0
    assert sweep(record, bell, at(6)) == 1


def test_nothing_is_rung_for_what_is_over(record: Database, bell: JobQueue) -> None:
    job = new_stage(record, new_surgery(record), now=at(0)).job.id
    with record.writing() as session:
        jobs.cancel(session, job, at(1))
    assert sweep(record, bell, at(100)) == 0
    assert bell.waiting() == set()
