"""What a worker does with a job from the queue: claim it, run its handler, store the result."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from functools import partial
from typing import Any, Protocol

import structlog

from contract.event import Actor
from settings import Settings
from spinewatch.errors import SpinewatchError
from spinewatch.progress import Progress
from store import jobs, leases, step_times
from store.clock import utc_now
from store.database import Database
from store.leases import Lease
from workers.attempt import Attempt, LeaseLostError
from workers.patience import patiently
from workers.registry import FilesWantedError, NotReadyError, Registry

_log = structlog.get_logger("worker")


class Runner(Protocol):
    """Runs the handler of a kind of job."""

    def run(self, kind: str, work: Any, progress: Progress, check: Callable[[], None]) -> Any:
        """Return the result of the handler for its input.

        Parameters
        ----------
        kind
            Kind of the job.
        work
            Input of the handler.
        progress
            Called when a step begins.
        check
            Called from time to time; what it raises ends the work.

        Returns
        -------
        object
            The result.
        """
        ...


class Here:
    """Runs handlers in this process.

    Parameters
    ----------
    registry
        Handlers by kind of job.
    """

    def __init__(self, registry: Registry) -> None:
        self._registry = registry

    def run(self, kind: str, work: Any, progress: Progress, check: Callable[[], None]) -> Any:
        """Return the result of the handler for its input.

        Parameters
        ----------
        kind
            Kind of the job.
        work
            Input of the handler.
        progress
            Called when a step begins.
        check
            Not called: ``progress`` ends the work.

        Returns
        -------
        object
            The result.
        """
        handler = self._registry.handler(kind)
        return handler.pack(handler.run(work, progress))


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
    runner
        Runs the handlers; by default in this process.
    """

    def __init__(
        self,
        database: Database,
        settings: Settings,
        registry: Registry,
        actor: Actor,
        runner: Runner | None = None,
    ) -> None:
        self.attempt: Attempt | None = None
        self._database = database
        self._registry = registry
        self._runner = runner or Here(registry)
        self._actor = actor
        self._lease_for = timedelta(seconds=settings.lease_seconds)
        self._max_attempts = settings.max_attempts
        self._patience = settings.max_run_seconds

    def handle(self, job_id: str) -> tuple[str, ...]:
        """Work on the job whose turn it is, if there is one.

        Parameters
        ----------
        job_id
            The job that was enqueued: not the one to work on, so that a backlog of one surgery does not delay another.

        Returns
        -------
        tuple of str
            Identifiers of the jobs that can be worked on now because of this one; the caller enqueues them.
        """
        with self._database.write(durable=False) as session:  # a claim lost with the power is made again
            lease = leases.claim_next(session, utc_now(), self._lease_for, self._max_attempts, self._actor)
        if lease is None:
            return ()
        self.attempt = Attempt(self._database, lease, self._lease_for)
        try:
            with structlog.contextvars.bound_contextvars(job_id=lease.job_id, attempt=lease.attempt):
                return self._work(self.attempt)
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
            held = leases.requeue(session, attempt.lease, utc_now(), self._actor, count_attempt=False)
        return attempt.lease.job_id if held else None

    def _work(self, attempt: Attempt) -> tuple[str, ...]:
        """Return the jobs to enqueue next."""
        lease = attempt.lease
        _log.info("job_started", kind=lease.kind)
        try:
            held, following = self._run_and_store(attempt)
        except LeaseLostError:
            _log.warning("lease_lost")
            return ()
        except NotReadyError as error:
            _log.info("job_waits", waits_for=error.job_id)
            return self._wait(lease, error.job_id)
        except SpinewatchError as error:
            held = patiently(partial(self._fail, lease, error), self._patience)
            _log.warning("job_failed", code=error.code, held=held)
            return self._waiting(lease)
        except Exception:  # a defect, or a fault of this machine: another attempt may succeed
            _log.exception("job_broke")
            patiently(partial(self._return, lease), self._patience)
            return ()
        _log.info("job_succeeded" if held else "lease_lost", seconds=round(attempt.seconds, 3))
        return following

    def _run_and_store(self, attempt: Attempt) -> tuple[bool, tuple[str, ...]]:
        """Return whether the lease was held to the end, so that the result is stored, and the jobs to enqueue next."""
        lease = attempt.lease
        handler = self._registry.handler(lease.kind)

        def load() -> Any:
            with self._database.read() as session:
                return handler.load(session, lease)

        work = patiently(load, self._patience)
        try:
            result = self._run(attempt, work)
        except FilesWantedError as error:
            result = self._run(attempt, self._with_files(lease.kind, work, error.sha256))
        now = utc_now()
        seconds = attempt.step_seconds()

        def store() -> tuple[bool, tuple[str, ...]]:
            with self._database.write() as session:
                if not leases.succeed(session, lease, now):
                    return False, ()
                step_times.add(session, lease.kind, seconds)
                added = handler.store(session, lease, result, now, self._actor)
                return True, (*added, *jobs.waiting_for(session, lease.job_id))

        return patiently(store, self._patience)

    def _run(self, attempt: Attempt, work: Any) -> Any:
        return self._runner.run(attempt.lease.kind, work, attempt.progress, attempt.check)

    def _with_files(self, kind: str, work: Any, wanted: frozenset[str]) -> Any:
        """Return the input of a work with the files that it wanted."""

        def load() -> Any:
            with self._database.read() as session:
                return self._registry.handler(kind).add_files(session, work, wanted)

        return patiently(load, self._patience)

    def _fail(self, lease: Lease, error: SpinewatchError) -> bool:
        """End a job that can never succeed; return whether the lease was held."""
        with self._database.write() as session:
            return leases.fail(session, lease, error.code, str(error), utc_now(), self._actor)

    def _return(self, lease: Lease) -> None:
        """Return the job to the queue for another attempt."""
        with self._database.write() as session:
            leases.requeue(session, lease, utc_now(), self._actor, count_attempt=True)

    def _wait(self, lease: Lease, other_id: str) -> tuple[str, ...]:
        """Return the job to the queue until another has ended; return it to enqueue at once if that has ended."""
        with self._database.write() as session:
            leases.requeue(session, lease, utc_now(), self._actor, count_attempt=False, waits_for=other_id)
            return (lease.job_id,) if jobs.has_ended(session, other_id) else ()

    def _waiting(self, lease: Lease) -> tuple[str, ...]:
        """Return the jobs that waited for one that has ended."""
        with self._database.read() as session:
            return jobs.waiting_for(session, lease.job_id)
