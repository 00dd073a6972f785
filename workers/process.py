"""A worker process: one thread handles jobs, one sends heartbeats, one sweeps; the jobs run in a process below it."""

from __future__ import annotations

import gc
import os
import signal
import socket
import threading
from collections.abc import Callable

import structlog

from contract.event import Actor, ActorKind
from settings import Settings
from store.database import Database
from store.processes import REPORT_SECONDS
from store.queue import JobQueue
from workers.consumer import Consumer
from workers.job_process import JobProcess
from workers.periodic import start_periodic
from workers.presence import Presence
from workers.registry import Registry
from workers.sweep import Sweep
from workers.worker import Worker

_HEARTBEATS_PER_LEASE = 5
_SWEEP_SECONDS = 1.0
_CHECK_SECONDS = 0.5
_FINISH_SECONDS = 1.5
_STUCK_SECONDS = 30.0
_STUCK_STATUS = 75  # EX_TEMPFAIL
_log = structlog.get_logger("worker")


def run(settings: Settings, registry: Registry, beat: Callable[[], None] | None = None) -> int:
    """Work on jobs until SIGTERM or SIGINT.

    Parameters
    ----------
    settings
        The settings.
    registry
        Handlers by kind of job.
    beat
        Called twice a second while the process works.

    Returns
    -------
    int
        Exit status.
    """
    jobs = JobProcess(registry, settings)  # before there are threads and connections
    database = Database(settings.database_url)
    worker = Worker(database, settings, registry, this_process(), jobs)
    queue = JobQueue(settings.queue, worker.handle)
    consumer = Consumer(queue)
    stop = _stop_on_signals()  # after the consumer, which sets signal handlers of its own
    start_periodic(
        "heartbeat",
        settings.lease_seconds / _HEARTBEATS_PER_LEASE,
        stop,
        lambda: _heartbeat(worker, settings.max_run_seconds),
    )
    start_periodic("sweep", _SWEEP_SECONDS, stop, Sweep(database, queue, settings.lease_seconds))
    presence = Presence(database, this_process().name)
    start_periodic("presence", REPORT_SECONDS, stop, presence.report)
    gc.collect()
    gc.freeze()  # what is loaded stays; a full collection during a job no longer visits it
    _log.info("worker_ready", pid=os.getpid())
    while not stop.wait(_CHECK_SECONDS):
        if beat is not None:
            beat()
        if not consumer.alive:
            _log.error("worker_thread_died")
            return 1
    if not consumer.stop(_FINISH_SECONDS):
        _release(worker, queue)
    presence.end()
    database.checkpoint()
    _log.info("worker_stopped")
    os._exit(0)  # an orderly exit would wait for the job


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
    if attempt.seconds > max_seconds + _STUCK_SECONDS:  # its process should have been ended long ago
        _log.error("worker_stuck", job_id=attempt.lease.job_id, seconds=round(attempt.seconds))
        os._exit(_STUCK_STATUS)  # a thread cannot be ended; the lease expires, and another takes the job
    attempt.heartbeat()


def _release(worker: Worker, queue: JobQueue) -> None:
    try:
        job_id = worker.release()
        if job_id is not None:
            queue.enqueue(job_id)
            _log.info("job_released", job_id=job_id)
    except Exception:  # the lease expires instead
        _log.exception("job_not_released")
