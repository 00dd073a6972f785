import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from store.queue import JobQueue
from tests.patience import PATIENCE_S
from tests.store.servers import STORAGES, queue_url
from workers.consumer import Consumer

SIGNALS = [signal.SIGTERM, signal.SIGINT, signal.SIGHUP]


@pytest.fixture(autouse=True)
def signal_handlers() -> Iterator[None]:
    """Restore the handlers that Huey's consumer replaces."""
    before = [signal.getsignal(number) for number in SIGNALS]
    yield
    for number, handler in zip(SIGNALS, before, strict=True):
        signal.signal(number, handler)


@pytest.fixture(params=STORAGES)
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    with queue_url(request.param, tmp_path) as url:
        yield url


def test_jobs_are_handled_in_order_until_the_consumer_stops(url: str) -> None:
    handled: list[str] = []
    done = threading.Event()

    def handle(job: str) -> None:
        handled.append(job)
        if len(handled) == 3:
            done.set()

    queue = JobQueue(url, handle)
    for job in ("a", "b", "c"):
        queue.enqueue(job)
    consumer = Consumer(queue)
    assert consumer.alive
    assert done.wait(PATIENCE_S)
    assert consumer.stop(20)
    queue.close()
    assert handled == ["a", "b", "c"]


def test_a_job_that_takes_long_outlives_the_stop(tmp_path: Path) -> None:
    started, end = threading.Event(), threading.Event()

    def handle(_: str) -> None:
        started.set()
        end.wait(PATIENCE_S)

    queue = JobQueue(f"sqlite:///{tmp_path / 'queue.sqlite'}", handle)
    queue.enqueue("long")
    consumer = Consumer(queue)
    assert started.wait(PATIENCE_S)
    assert not consumer.stop(0.1)
    end.set()
    assert consumer.stop(20)
    queue.close()
