"""What a worker does with a job from the queue: claim it, run its handler, store the result."""

from __future__ import annotations

from datetime import timedelta

import structlog

from contract.event import Actor
from settings import Settings
from spinewatch.errors import SpinewatchError
from store import jobs
from store.clock import utc_now
from store.database import Database
from workers.attempt import Attempt, LeaseLostError
from workers.registry import Registry

_log = structlog.get_logger("worker")


class Worker:
    """Works on one job at a time; ``attempt`` is the current one, None between jobs.

    Parameters
    ----------
    database
        The database.
    settings
        Duration of a lease and number of attempts.
    registry
        Handlers by kind of job.
    actor
        This worker, as it appears in events.
    """

    def __init__(self, database: Database, settings: Settings, registry: Registry, actor: Actor) -> None:
        self.attempt: Attempt | None = None
        self._database = database
        self._registry = registry
        self._actor = actor
        self._lease_for = timedelta(seconds=settings.lease_seconds)
        self._max_attempts = settings.max_attempts

    def handle(self, job_id: str) -> None:
        """Work on a job if it can be claimed; a message about any other job is ignored.

        Parameters
        ----------
        job_id
            Identifier of the job.
        """
        with self._database.write() as session:
            lease = jobs.claim(session, job_id, utc_now(), self._lease_for, self._max_attempts, self._actor)
        if lease is None:
            return
        self.attempt = Attempt(self._database, lease, self._lease_for)
        try:
            with structlog.contextvars.bound_contextvars(job_id=job_id, attempt=lease.attempt):
                self._work(self.attempt)
        finally:
            self.attempt = None

    def release(self) -> str | None:
        """Return the current job to the queue; the attempt does not count.

        Returns
        -------
        str or None
            Identifier of the job, which the caller enqueues; None when there is none or its lease is lost.
        """
        attempt = self.attempt
        if attempt is None:
            return None
        with self._database.write() as session:
            held = jobs.requeue(session, attempt.lease, utc_now(), self._actor, count_attempt=False)
        return attempt.lease.job_id if held else None

    def _work(self, attempt: Attempt) -> None:
        lease = attempt.lease
        _log.info("job_started", kind=lease.kind)
        try:
            held = self._run_and_store(attempt)
        except LeaseLostError:
            _log.warning("lease_lost")
            return
        except SpinewatchError as error:
            with self._database.write() as session:
                held = jobs.fail(session, lease, error.code, str(error), utc_now(), self._actor)
            _log.warning("job_failed", code=error.code, held=held)
            return
        except Exception:  # a defect, or a fault of this machine: another attempt may succeed
            _log.exception("job_broke")
            with self._database.write() as session:
                jobs.requeue(session, lease, utc_now(), self._actor, count_attempt=True)
            return
        _log.info("job_succeeded" if held else "lease_lost", seconds=round(attempt.seconds, 3))

    def _run_and_store(self, attempt: Attempt) -> bool:
        """Return whether the lease was held to the end, so that the result is stored."""
        lease = attempt.lease
        handler = self._registry.handler(lease.kind)
        with self._database.read() as session:
            work = handler.load(session, lease)
        result = handler.run(work, attempt.progress)
        now = utc_now()
        with self._database.write() as session:
            held = jobs.succeed(session, lease, now)
            if held:
                handler.store(session, lease, result, now, self._actor)
        return held
