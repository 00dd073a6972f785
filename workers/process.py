"""The life of a worker process: one thread answers the bell, one keeps the lease, one sweeps."""

from __future__ import annotations

import os
import resource
import signal
import threading
from collections.abc import Callable

import numpy as np
import structlog

from settings import Settings
from store.clock import utc_now
from store.database import Database
from store.queue import JobQueue
from workers.sweep import sweep
from workers.worker import CarryOut, Worker

_POLL_SECONDS = 0.02
_SWEEP_SECONDS = 1.0
_FINISH_SECONDS = 1.5
_KEPT_BYTES = 16 << 20
_OVERDUE_STATUS = 75  # EX_TEMPFAIL
_log = structlog.get_logger("worker")


def run(settings: Settings, carry_out: CarryOut) -> int:
    """Answer the bell until SIGTERM or SIGINT; return the exit status."""
    limit_memory(settings.worker_memory_bytes)
    keep_freed_memory()
    record = Database(settings.database_url)
    worker = Worker(record, settings, carry_out)
    bell = JobQueue(settings.queue_file, worker.answer)
    consumer = bell.huey.create_consumer(
        workers=1,
        periodic=False,
        initial_delay=_POLL_SECONDS,
        max_delay=_POLL_SECONDS,
        backoff=1.0,
        check_worker_health=False,
    )
    consumer.start()
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):  # after the consumer has set its own
        signal.signal(number, lambda *_: stop.set())
    _repeat("heartbeat", settings.lease_seconds / 5, stop, lambda: _beat(worker, settings.max_run_seconds))
    _repeat("sweep", _SWEEP_SECONDS, stop, lambda: sweep(record, bell, utc_now()))
    _log.info("worker_ready", pid=os.getpid())
    (_, answering), *_ = consumer.worker_threads
    while not stop.wait(0.5):
        if not answering.is_alive():
            _log.error("worker_thread_died")
            return 1
    consumer.stop_flag.set()
    answering.join(_FINISH_SECONDS)
    if answering.is_alive():
        _give_back(worker, bell)
    _log.info("worker_stopped")
    os._exit(0)  # the library may be deep in native code, which an orderly exit would wait for


def limit_memory(size_bytes: int) -> None:
    """Bound this process's address space, so that no picture can take the machine's memory."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    allowed = size_bytes if hard == resource.RLIM_INFINITY else min(size_bytes, hard)
    resource.setrlimit(resource.RLIMIT_AS, (allowed, hard))


def keep_freed_memory() -> None:
    """Have freed memory kept for the next picture: fresh pages cost an eighth of the time of a detection.

    glibc keeps blocks as large as the largest freed so far, and twice as much in all (mallopt(3), M_MMAP_THRESHOLD).
    """
    np.empty(_KEPT_BYTES, np.uint8)


def _beat(worker: Worker, max_seconds: float) -> None:
    attempt = worker.attempt
    if attempt is None:
        return
    if attempt.seconds > max_seconds:
        _log.error("job_overdue", job_id=attempt.lease.job_id, seconds=round(attempt.seconds))
        os._exit(_OVERDUE_STATUS)  # a thread cannot be ended; the lease runs out and another attempt follows
    attempt.beat()


def _give_back(worker: Worker, bell: JobQueue) -> None:
    try:
        job_id = worker.release()
        if job_id is not None:
            bell.ring(job_id)
            _log.info("job_given_back", job_id=job_id)
    except Exception:  # the lease runs out instead
        _log.exception("job_not_given_back")


def _repeat(name: str, seconds: float, stop: threading.Event, action: Callable[[], object]) -> None:
    def loop() -> None:
        while not stop.wait(seconds):
            try:
                action()
            except Exception:  # the database may be busy; the next round does it
                _log.exception("round_failed", thread=name)

    threading.Thread(target=loop, name=name, daemon=True).start()
