"""The life of a worker process: its longest job, and its end."""

import subprocess
import sys
from collections.abc import Iterator

import pytest

from contract.event import ActorKind
from contract.job import JobState
from settings import Settings
from store import jobs
from store.clock import utc_now
from store.database import Database
from store.queue import JobQueue
from store.tables.jobs import Job
from tests.paths import PROJECT
from tests.patience import PATIENCE_S
from tests.store.builders import new_stage, new_surgery, sample_pair
from workers.process import this_process


def python(program: str, **settings: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=PROJECT,
        env={"OPENBLAS_NUM_THREADS": "1", **settings},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


@pytest.fixture
def queue_url(database: Database) -> str:
    """The URL that a process takes by default."""
    return Settings(database_url=database.url).queue


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
from store import jobs
from store.database import Database
from store.tables.jobs import Job
from workers.process import run
from workers.registry import Handler, Registry
class Slow(Handler):
    kind = "stage"
    def load(self, session, lease):
        return os.getpid()
    def run(self, work, progress):
        {work}
    def store(self, session, lease, result, now, actor):
        return ()
settings = Settings()
def end_after_the_job():
    database = Database(settings.database_url)
    with database.read() as session:
        ended = all(jobs.has_ended(session, row.id) for row in session.query(Job))
    database.close()
    if ended:
        os.kill(os.getpid(), signal.SIGTERM)
raise SystemExit(run(settings, Registry([Slow()]), end_after_the_job))
"""
TOO_LARGE = "bytearray(8 << 30)"
SPINS = "exec('while True: pass')"


@pytest.mark.parametrize(
    ("work", "code", "word"),
    [
        ("time.sleep(60)", "job-overdue", "after 1 s"),
        (SPINS, "job-overdue", "after 1 s"),
        (TOO_LARGE, "job-out-of-memory", "SPINEWATCH_WORKER_MEMORY_BYTES"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", "job-crashed", "signal 11"),
        ("os._exit(3)", "job-crashed", "exit status 3"),
    ],
)
def test_a_job_that_ends_its_process_fails_once_by_name_and_the_worker_goes_on(
    database: Database, waiting: str, work: str, code: str, word: str
) -> None:
    ended = python(
        PROGRAM.format(work=work), SPINEWATCH_DATABASE_URL=database.url, SPINEWATCH_MAX_RUN_SECONDS="1"
    )
    assert ended.returncode == 0, ended.stderr
    job = show(database, waiting)
    assert (job.state, job.attempts) == (JobState.FAILED, 1), ended.stderr
    assert job.error is not None
    assert job.error["code"] == code
    assert word in job.error["detail"]


def test_cpu_time_is_limited_apart_from_time(database: Database, waiting: str) -> None:
    ended = python(
        PROGRAM.format(work=SPINS), SPINEWATCH_DATABASE_URL=database.url, SPINEWATCH_MAX_CPU_SECONDS="1"
    )
    assert ended.returncode == 0, ended.stderr
    job = show(database, waiting)
    assert job.error is not None
    assert (job.error["code"], job.attempts) == ("job-overdue", 1)
    assert "CPU time" in job.error["detail"]


def test_a_stopped_worker_returns_a_long_job_to_the_queue(
    database: Database, waiting: str, queue_url: str
) -> None:
    work = "os.kill(work, signal.SIGTERM) or time.sleep(60)"
    ended = python(PROGRAM.format(work=work), SPINEWATCH_DATABASE_URL=database.url)
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
