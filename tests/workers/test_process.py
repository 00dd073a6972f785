"""The life of a worker process: its longest job, and its end."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from contract.event import ActorKind
from contract.job import JobState
from store import jobs
from store.clock import utc_now
from store.database import Database
from store.queue import JobQueue
from store.tables import Job
from tests.paths import PROJECT
from tests.store.builders import new_stage, new_surgery, sample_pair
from workers.process import this_process


def python(program: str, **settings: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=PROJECT,
        env={"OPENBLAS_NUM_THREADS": "1", **settings},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def queue_url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'database-queue.sqlite'}"


@pytest.fixture
def waiting(database: Database, queue_url: str) -> Iterator[str]:
    """A job that is enqueued and waits for a worker process of the same folder."""
    job = new_stage(database, new_surgery(database), pair=sample_pair(), now=utc_now()).job.id
    queue = JobQueue(queue_url)
    queue.enqueue(job)
    yield job
    queue.close()


def show(database: Database, job: str) -> Job:
    with database.read() as session:
        return jobs.get(session, job)


PROGRAM = """
import os, signal, time
from settings import Settings
from workers.process import run
from workers.registry import Handler, Registry
class Slow(Handler):
    kind = "stage"
    def load(self, session, lease):
        return None
    def run(self, work, progress):
        {first}
        time.sleep(60)
    def store(self, session, lease, result, now, actor):
        raise AssertionError
raise SystemExit(run(Settings(), Registry([Slow()])))
"""


def test_a_job_that_hangs_ends_its_process_and_stays_in_the_database(
    database: Database, waiting: str
) -> None:
    ended = python(
        PROGRAM.format(first="pass"),
        SPINEWATCH_DATABASE_URL=database.url,
        SPINEWATCH_MAX_RUN_SECONDS="1",
        SPINEWATCH_LEASE_SECONDS="1",
    )
    assert ended.returncode == 75, ended.stderr
    job = show(database, waiting)
    assert (job.state, job.attempts) == (JobState.RUNNING, 1)
    assert job.lease_until is not None


def test_a_stopped_worker_returns_a_long_job_to_the_queue(
    database: Database, waiting: str, queue_url: str
) -> None:
    ended = python(
        PROGRAM.format(first="os.kill(os.getpid(), signal.SIGTERM)"), SPINEWATCH_DATABASE_URL=database.url
    )
    assert ended.returncode == 0, ended.stderr
    job = show(database, waiting)
    assert (job.state, job.attempts, job.lease_owner) == (JobState.QUEUED, 0, None)
    queue = JobQueue(queue_url)
    assert queue.waiting() == {waiting}
    queue.close()


def test_a_worker_process_is_an_actor() -> None:
    actor = this_process()
    assert actor.kind is ActorKind.WORKER
    assert ":" in actor.name
