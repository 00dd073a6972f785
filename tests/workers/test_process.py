"""The life of a worker process: its memory, its longest job, its end."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from store import jobs
from store.clock import utc_now
from store.database import Database
from store.queue import JobQueue
from store.tables import Job, JobState
from tests.store.builders import new_stage, new_surgery, sample_pair

MIB = 1024 * 1024


def python(program: str, **settings: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        env={"OPENBLAS_NUM_THREADS": "1", **settings},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def waiting(record: Database, tmp_path: Path) -> Iterator[str]:
    """A job that was rung and waits for a worker process of the same folder."""
    job = new_stage(record, new_surgery(record), pair=sample_pair(), now=utc_now()).job.id
    bell = JobQueue(tmp_path / "record-bell.sqlite")
    bell.ring(job)
    yield job
    bell.close()


def show(record: Database, job: str) -> Job:
    with record.reading() as session:
        return jobs.get(session, job)


def test_a_process_cannot_take_more_memory_than_it_was_given() -> None:
    ended = python(
        f"from workers.process import limit_memory; limit_memory({600 * MIB}); bytearray({700 * MIB})"
    )
    assert ended.returncode == 1
    assert "MemoryError" in ended.stderr


HANG = """
import time
from settings import Settings
from workers.process import run
raise SystemExit(run(Settings(), lambda work, progress: time.sleep(60)))
"""


def test_a_job_that_hangs_ends_its_process_and_stays_in_the_record(record: Database, waiting: str) -> None:
    ended = python(
        HANG,
        SPINEWATCH_DATABASE_URL=record.url,
        SPINEWATCH_MAX_RUN_SECONDS="1",
        SPINEWATCH_LEASE_SECONDS="1",
    )
    assert ended.returncode == 75, ended.stderr
    job = show(record, waiting)
    assert (job.state, job.attempts) == (JobState.RUNNING, 1)
    assert job.lease_until is not None


STOP = """
import os, signal, time
from settings import Settings
from workers.process import run
def hang(work, progress):
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(60)
raise SystemExit(run(Settings(), hang))
"""


def test_a_worker_that_must_stop_gives_a_long_job_back(
    record: Database, waiting: str, tmp_path: Path
) -> None:
    ended = python(STOP, SPINEWATCH_DATABASE_URL=record.url)
    assert ended.returncode == 0, ended.stderr
    job = show(record, waiting)
    assert (job.state, job.attempts, job.lease_owner) == (JobState.QUEUED, 0, None)
    bell = JobQueue(tmp_path / "record-bell.sqlite")
    assert bell.waiting() == {waiting}
    bell.close()
