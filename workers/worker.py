"""What a worker does when the bell rings: claim the job, do the work, write the end of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import timedelta
from typing import Any

import structlog

from settings import Settings
from spinewatch.errors import SpinewatchError
from spinewatch.progress import Progress
from store import jobs
from store.clock import utc_now
from store.database import Database
from store.work import Work, work_of
from workers.attempt import Attempt, LeaseLostError

CarryOut = Callable[[Work, Progress], Mapping[str, Any]]
"""From what there is to do to the document it ends with; raises a ``SpinewatchError`` for what cannot be done."""

_log = structlog.get_logger("worker")


class Worker:
    """Works on one job at a time; ``attempt`` is the one at hand."""

    def __init__(self, record: Database, settings: Settings, carry_out: CarryOut) -> None:
        self.attempt: Attempt | None = None
        self._record = record
        self._carry_out = carry_out
        self._lease_for = timedelta(seconds=settings.lease_seconds)
        self._max_attempts = settings.max_attempts

    def answer(self, job_id: str) -> None:
        """Do the work on a job if it is there to be taken; a ring for any other job is no error."""
        with self._record.writing() as session:
            lease = jobs.claim(session, job_id, utc_now(), self._lease_for, self._max_attempts)
        if lease is None:
            return
        self.attempt = Attempt(self._record, lease, self._lease_for)
        try:
            with structlog.contextvars.bound_contextvars(job_id=job_id, attempt=lease.attempt):
                self._work(self.attempt)
        finally:
            self.attempt = None

    def release(self) -> str | None:
        """Give the job at hand back to the queue, uncounted, and return its id."""
        attempt = self.attempt
        if attempt is None:
            return None
        with self._record.writing() as session:
            given_back = jobs.requeue(session, attempt.lease, utc_now(), count_attempt=False)
        return attempt.lease.job_id if given_back else None

    def _work(self, attempt: Attempt) -> None:
        lease = attempt.lease
        _log.info("job_started")
        try:
            with self._record.reading() as session:
                work = work_of(session, lease)
            result = self._carry_out(work, attempt.note)
            with self._record.writing() as session:
                held = jobs.succeed(session, lease, result, utc_now())
        except LeaseLostError:
            _log.warning("lease_lost")
            return
        except SpinewatchError as error:
            with self._record.writing() as session:
                held = jobs.fail(session, lease, error.code, str(error), utc_now())
            _log.warning("job_failed", code=error.code, held=held)
            return
        except Exception:  # a fault of ours or of this machine: another attempt may do better
            _log.exception("job_broke")
            with self._record.writing() as session:
                jobs.requeue(session, lease, utc_now(), count_attempt=True)
            return
        _log.info("job_succeeded" if held else "lease_lost", seconds=round(attempt.seconds, 3))
