"""A worker in this process: claims, attempts, and results that hold only with the lease."""

from datetime import timedelta
from typing import Any

import pytest
from sqlalchemy import func, select

from contract.job import JobState
from settings import Settings
from store import jobs, leases
from store.clock import utc_now
from store.database import Database
from store.tables.events import Event
from store.tables.jobs import Job
from tests.backends import fault
from tests.store.builders import CLIENT, WORKER
from tests.workers.echo import EchoHandler
from workers.registry import FilesWantedError, NotReadyError, Registry
from workers.worker import Worker

HOUR = timedelta(hours=1)


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
    assert error["code"] == leases.ATTEMPTS_EXHAUSTED


def test_a_result_that_cannot_be_stored_is_tried_again(database: Database, job: str) -> None:
    echo = worker(database)
    with fault(database.url, "events", "NEW.action LIKE 'echo:%'"):
        echo.handle(job)
        assert show(database, job).state is JobState.QUEUED
    echo.handle(job)
    assert show(database, job).state is JobState.SUCCEEDED
    assert results(database) == 1


def test_a_released_job_is_queued_and_its_attempt_does_not_count(database: Database, job: str) -> None:
    released: list[str | None] = []
    workers: list[Worker] = []
    workers.append(worker(database, Handler(lambda: released.append(workers[0].release()))))
    workers[0].handle(job)
    assert released == [job]
    assert (show(database, job).state, show(database, job).attempts) == (JobState.QUEUED, 0)
    assert results(database) == 0


class Following(EchoHandler):
    """A handler that adds a job when it stores its result."""

    def store(self, session: Any, lease: Any, result: str, now: Any, actor: Any) -> tuple[str, ...]:
        super().store(session, lease, result, now, actor)
        return (jobs.add(session, "echo", "next", now, {"word": "again"}).id,)


def test_the_jobs_that_a_result_adds_are_returned_after_the_commit(database: Database, job: str) -> None:
    (next_job,) = worker(database, Following()).handle(job)
    assert show(database, next_job).state is JobState.QUEUED


class Asking(EchoHandler):
    """A handler whose work wants a file."""

    def add_files(self, session: Any, work: str, wanted: frozenset[str]) -> str:
        return f"{work} {sorted(wanted)}"

    def run(self, work: str, progress: Any) -> str:
        if work == "hello":
            raise FilesWantedError(frozenset({"a1"}))
        return super().run(work, progress)

    def pack(self, result: str) -> str:
        return f"packed {result}"


def test_work_that_wants_files_is_begun_again_with_them(database: Database, job: str) -> None:
    worker(database, Asking()).handle(job)
    assert (show(database, job).state, show(database, job).attempts) == (JobState.SUCCEEDED, 1)
    with database.read() as session:
        stored = select(Event.action).where(Event.action.startswith("echo:"))
        assert session.scalars(stored).all() == ["echo:packed hello ['a1'] hello ['a1']"]


class Waiting(EchoHandler):
    """A handler whose work with the word "later" waits for another job."""

    def __init__(self, other: str) -> None:
        self._other = other
        self.runs = 0

    def run(self, work: str, progress: Any) -> str:
        self.runs += 1
        if work == "later" and self.runs == 1:
            raise NotReadyError(self._other)
        return super().run(work, progress)


def test_a_job_that_is_not_ready_waits_for_the_other_without_an_attempt(database: Database, job: str) -> None:
    with database.write() as session:
        later = jobs.add(
            session, "echo", "subject", utc_now() - HOUR, {"word": "later"}
        ).id  # its turn is first
    handler = Waiting(job)
    echo = worker(database, handler)
    assert echo.handle(later) == ()
    waiting = show(database, later)
    assert (waiting.state, waiting.attempts, waiting.waits_for) == (JobState.QUEUED, 0, job)
    assert echo.handle(later) == (later,)  # the message starts the other job, whose end the waiting one needs
    assert (handler.runs, show(database, job).state) == (2, JobState.SUCCEEDED)
    assert echo.handle(later) == ()
    assert (show(database, later).state, show(database, later).attempts) == (JobState.SUCCEEDED, 1)


def test_a_job_that_fails_also_ends_the_waiting(database: Database) -> None:
    with database.write() as session:
        bad, later = (
            jobs.add(session, "echo", "subject", utc_now() - age, {"word": word}).id
            for word, age in (("nothing", 0 * HOUR), ("later", HOUR))
        )
    echo = worker(database, Waiting(bad))
    echo.handle(later)
    assert echo.handle(bad) == (later,)


def test_a_job_that_waits_for_one_that_has_just_ended_is_enqueued_at_once(
    database: Database, job: str
) -> None:
    worker(database).handle(job)
    with database.write() as session:
        later = jobs.add(session, "echo", "subject", utc_now(), {"word": "later"}).id
    echo = worker(database, Waiting(job))
    assert echo.handle(later) == (later,)
    echo.handle(later)
    assert show(database, later).state is JobState.SUCCEEDED
