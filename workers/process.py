"""A worker process: one thread handles jobs, one sends heartbeats, one sweeps."""

from __future__ import annotations

import os
import signal
import socket
import threading

import structlog

from contract.event import Actor, ActorKind
from settings import Settings
from store.clock import utc_now
from store.database import Database
from store.queue import JobQueue
from workers.consumer import Consumer
from workers.memory import keep_freed_memory, limit_memory
from workers.periodic import start_periodic
from workers.registry import Registry
from workers.sweep import sweep
from workers.worker import Worker

_HEARTBEATS_PER_LEASE = 5
_SWEEP_SECONDS = 1.0
_CHECK_SECONDS = 0.5
_FINISH_SECONDS = 1.5
_OVERDUE_STATUS = 75  # EX_TEMPFAIL
_log = structlog.get_logger("worker")


def run(settings: Settings, registry: Registry) -> int:
    """Work on jobs until SIGTERM or SIGINT.

    Parameters
    ----------
    settings
        The settings.
    registry
        Handlers by kind of job.

    Returns
    -------
    int
        Exit status.
    """
    limit_memory(settings.worker_memory_bytes)
    keep_freed_memory()
    database = Database(settings.database_url)
    worker = Worker(database, settings, registry, this_process())
    queue = JobQueue(settings.queue, worker.handle)
    consumer = Consumer(queue)
    stop = _stop_on_signals()  # after the consumer, which sets signal handlers of its own
    start_periodic(
        "heartbeat",
        settings.lease_seconds / _HEARTBEATS_PER_LEASE,
        stop,
        lambda: _heartbeat(worker, settings.max_run_seconds),
    )
    start_periodic("sweep", _SWEEP_SECONDS, stop, lambda: sweep(database, queue, utc_now()))
    _log.info("worker_ready", pid=os.getpid())
    while not stop.wait(_CHECK_SECONDS):
        if not consumer.alive:
            _log.error("worker_thread_died")
            return 1
    if not consumer.stop(_FINISH_SECONDS):
        _release(worker, queue)
    _log.info("worker_stopped")
    os._exit(0)  # the library may be deep in native code, which an orderly exit would wait for


def this_process() -> Actor:
    """Return this worker process as an actor.

    Returns
    -------
    Actor
        Named by host and process.
    """
    return Actor(kind=ActorKind.WORKER, name=f"{socket.gethostname()[:100]}:{os.getpid()}")


def _stop_on_signals() -> threading.Event:
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    return stop


def _heartbeat(worker: Worker, max_seconds: float) -> None:
    attempt = worker.attempt
    if attempt is None:
        return
    if attempt.seconds > max_seconds:
        _log.error("job_overdue", job_id=attempt.lease.job_id, seconds=round(attempt.seconds))
        os._exit(_OVERDUE_STATUS)  # a thread cannot be ended; the lease expires and another attempt follows
    attempt.heartbeat()


def _release(worker: Worker, queue: JobQueue) -> None:
    try:
        job_id = worker.release()
        if job_id is not None:
            queue.enqueue(job_id)
            _log.info("job_released", job_id=job_id)
    except Exception:  # the lease expires instead
        _log.exception("job_not_released")
