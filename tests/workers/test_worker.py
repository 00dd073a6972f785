"""A worker in this process: claims, attempts, and results that hold only with the lease."""

from typing import Any

import pytest
from sqlalchemy import func, select, text

from contract.job import JobState
from settings import Settings
from store import jobs
from store.clock import utc_now
from store.database import Database
from store.tables import Event, Job
from tests.store.builders import CLIENT, WORKER
from tests.workers.echo import EchoHandler
from workers.registry import Registry
from workers.worker import Worker


class Handler(EchoHandler):
    """A handler that does something else first."""

    def __init__(self, first: Any) -> None:
        self._first = first

    def run(self, work: str, progress: Any) -> str:
        self._first()
        return super().run(work, progress)


@pytest.fixture
def job(database: Database) -> str:
    with database.write() as session:
        return jobs.add(session, "echo", "subject", utc_now(), {"word": "hello"}).id


def worker(database: Database, handler: EchoHandler | None = None, **settings: Any) -> Worker:
    return Worker(database, Settings(**settings), Registry([handler or EchoHandler()]), WORKER)


def show(database: Database, job: str) -> Job:
    with database.read() as session:
        return jobs.get(session, job)


def results(database: Database) -> int:
    with database.read() as session:
        stored = select(func.count()).select_from(Event).where(Event.action.startswith("echo:"))
        return session.scalar(stored) or 0


def test_a_job_is_done_once_however_often_it_is_enqueued(database: Database, job: str) -> None:
    echo = worker(database)
    for _ in range(3):
        echo.handle(job)
    assert echo.attempt is None
    assert echo.release() is None
    assert (show(database, job).state, show(database, job).attempts) == (JobState.SUCCEEDED, 1)
    assert results(database) == 1


def test_the_result_of_a_cancelled_job_is_discarded(database: Database, job: str) -> None:
    def cancel() -> None:
        with database.write() as session:
            jobs.cancel(session, job, utc_now(), CLIENT)

    worker(database, Handler(cancel)).handle(job)
    assert show(database, job).state is JobState.CANCELLED
    assert results(database) == 0


def test_an_unexpected_error_is_tried_again_until_attempts_run_out(database: Database, job: str) -> None:
    def fault() -> None:
        raise RuntimeError

    broken = worker(database, Handler(fault), max_attempts=2)
    states = []
    for _ in range(4):
        broken.handle(job)
        states.append((show(database, job).state, show(database, job).attempts))
    queued, failed = JobState.QUEUED, JobState.FAILED
    assert states == [(queued, 1), (queued, 2), (failed, 2), (failed, 2)]
    error = show(database, job).error
    assert error is not None
    assert error["code"] == jobs.ATTEMPTS_EXHAUSTED


def test_a_result_that_cannot_be_stored_is_tried_again(database: Database, job: str) -> None:
    refuse = (
        "CREATE TRIGGER fault BEFORE INSERT ON events WHEN NEW.action LIKE 'echo:%'"
        " BEGIN SELECT RAISE(ABORT, 'fault'); END"
    )
    echo = worker(database)
    states = []
    for statement in (refuse, "DROP TRIGGER fault"):
        with database.write() as session:
            session.execute(text(statement))
        echo.handle(job)
        states.append(show(database, job).state)
    assert states == [JobState.QUEUED, JobState.SUCCEEDED]
    assert results(database) == 1


def test_a_released_job_is_queued_and_its_attempt_does_not_count(database: Database, job: str) -> None:
    released: list[str | None] = []
    workers: list[Worker] = []
    workers.append(worker(database, Handler(lambda: released.append(workers[0].release()))))
    workers[0].handle(job)
    assert released == [job]
    assert (show(database, job).state, show(database, job).attempts) == (JobState.QUEUED, 0)
    assert results(database) == 0
