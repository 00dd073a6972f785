"""Handlers by kind; a new kind of job from its file to its result."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import select

from contract.job import JobState
from settings import Settings
from store import jobs
from store.clock import utc_now
from store.database import Database
from store.queue import JobQueue
from store.tables.events import Event
from store.tables.jobs import CALIBRATION_JOB, STAGE_JOB, Job
from tests.store.builders import WORKER
from tests.workers.echo import EchoHandler
from workers.registry import Registry, UnknownJobKindError, discover
from workers.worker import Worker


def test_handlers_are_found_by_their_files() -> None:
    registry = discover(Settings())
    assert registry.handler(STAGE_JOB).kind == STAGE_JOB
    assert registry.handler(CALIBRATION_JOB).kind == CALIBRATION_JOB
    with pytest.raises(UnknownJobKindError, match="echo"):
        registry.handler("echo")


def test_a_kind_has_one_handler() -> None:
    registry = Registry([EchoHandler()])
    with pytest.raises(ValueError, match="echo"):
        registry.register(EchoHandler())


@pytest.fixture
def queue(database: Database, tmp_path: Path) -> Iterator[JobQueue]:
    registry = discover(Settings())
    registry.register(EchoHandler())
    worker = Worker(database, Settings(), registry, WORKER)
    queue = JobQueue(f"sqlite:///{tmp_path / 'queue.sqlite'}", worker.handle)
    yield queue
    queue.close()


def run(database: Database, queue: JobQueue, kind: str, word: str) -> Job:
    """Submit a job, let the worker take it from the queue, and return it."""
    with database.write() as session:
        job = jobs.add(session, kind, "the-subject", utc_now(), {"word": word, "surgery_id": "the-surgery"})
    queue.enqueue(job.id)
    queue.huey.execute(queue.huey.dequeue())
    with database.read() as session:
        return jobs.get(session, job.id)


def test_a_new_kind_of_job_is_one_file(database: Database, queue: JobQueue) -> None:
    job = run(database, queue, "echo", "hello")
    assert (job.state, job.progress, job.attempts, job.error) == (JobState.SUCCEEDED, 1.0, 1, None)
    with database.read() as session:
        last = session.scalars(select(Event).order_by(Event.seq.desc())).first()
    assert last is not None
    assert (last.action, last.subject_id, last.surgery_id) == (
        "echo:hello hello",
        "the-subject",
        "the-surgery",
    )
    assert (last.actor_kind, last.actor_name) == (WORKER.kind, WORKER.name)


def test_a_new_kind_of_job_fails_by_the_name_of_its_error(database: Database, queue: JobQueue) -> None:
    job = run(database, queue, "echo", "nothing")
    assert job.state is JobState.FAILED
    assert job.error == {
        "code": "invalid-parameter",
        "detail": "there is no word to repeat; give one",
    }


def test_a_job_without_a_handler_fails_by_name(database: Database, queue: JobQueue) -> None:
    job = run(database, queue, "unheard-of", "hello")
    assert job.state is JobState.FAILED
    assert job.error is not None
    assert job.error["code"] == "unknown-job-kind"
