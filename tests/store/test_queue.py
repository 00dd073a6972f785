"""The queue on each storage; Redis and PostgreSQL where a server runs."""

import json
import sqlite3
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from store.errors import QueueURLError
from store.queue import JobQueue
from tests.store.servers import STORAGES, queue_url


@pytest.fixture(params=STORAGES)
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    with queue_url(request.param, tmp_path) as url:
        yield url


@pytest.fixture
def queue(url: str) -> Iterator[JobQueue]:
    queue = JobQueue(url)
    yield queue
    queue.close()


def test_jobs_wait_until_they_are_handled(url: str, queue: JobQueue) -> None:
    for job in ("a", "b", "a"):
        queue.enqueue(job)
    assert queue.waiting() == {"a", "b"}
    handled: list[str] = []
    worker = JobQueue(url, handled.append)
    for _ in range(3):
        worker.huey.execute(worker.huey.dequeue())
    worker.close()
    assert handled == ["a", "b", "a"]
    assert queue.waiting() == set()


def test_only_the_job_s_identifier_is_sent_and_as_json(queue: JobQueue) -> None:
    queue.enqueue("the-job")
    (data,) = queue.huey.storage.enqueued_items()
    assert json.loads(bytes(data)).count(["the-job"]) == 1


def test_a_message_that_is_not_json_is_not_run(tmp_path: Path) -> None:
    queue = JobQueue(f"sqlite:///{tmp_path / 'queue.sqlite'}")
    queue.enqueue("good")
    connection = sqlite3.connect(tmp_path / "queue.sqlite")
    with connection:
        connection.execute("UPDATE task SET data = ?", (b"\x80\x04K\x01.",))  # a pickle
    connection.close()
    with pytest.raises(ValueError, match="decode"):
        queue.huey.dequeue()
    assert queue.waiting() == set()
    queue.close()


def test_processes_that_start_together_share_a_new_queue(url: str) -> None:
    together = threading.Barrier(6)

    def start(job: int) -> None:
        together.wait()
        queue = JobQueue(url)
        queue.enqueue(str(job))
        queue.close()

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(start, range(6)))
    queue = JobQueue(url)
    assert queue.waiting() == {str(job) for job in range(6)}
    queue.close()


def test_a_server_that_does_not_run_is_named() -> None:
    with pytest.raises(QueueURLError, match="SPINEWATCH_QUEUE_URL"):
        JobQueue("postgresql://nobody@127.0.0.1:1/none")


def test_the_file_of_a_queue_and_its_folder_are_created(tmp_path: Path) -> None:
    JobQueue(f"sqlite:///{tmp_path / 'new' / 'queue.sqlite'}").close()
    assert (tmp_path / "new" / "queue.sqlite").exists()


@pytest.mark.parametrize("url", ["nonsense", "sqlite://", "amqp://host/queue", "/var/queue.sqlite"])
def test_a_url_that_cannot_be_used_is_named(url: str) -> None:
    with pytest.raises(QueueURLError, match="SPINEWATCH_QUEUE_URL"):
        JobQueue(url)
