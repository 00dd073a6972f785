"""The sweep: ends leases whose workers are silent, and enqueues jobs whose messages were lost.

A job is silent when its row stays as it is for some time by this process's monotonic clock; no stored time is compared
with a clock, so that setting the clock of a host neither delays a job nor starts it twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from store import job_sweep
from store.clock import utc_now
from store.database import Database
from store.job_sweep import Unended
from store.queue import JobQueue

_QUIET_SECONDS = 2.0  # a job that was enqueued so recently may be about to be claimed
_LATE_SECONDS = 1.0


class Sweep:
    """Looks for silent jobs, time and again.

    Parameters
    ----------
    database
        The database.
    queue
        The queue.
    lease_seconds
        Time without a heartbeat after which a lease ends, s.
    clock
        A clock that is never set, s.
    """

    def __init__(
        self,
        database: Database,
        queue: JobQueue,
        lease_seconds: float,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._database = database
        self._queue = queue
        self._lease_seconds = lease_seconds
        self._clock = clock
        self._since: dict[Unended, float] = {}

    def __call__(self) -> int:
        """Look once.

        No more messages are enqueued than there are jobs without one, or a backlog would multiply: any message starts
        the job whose turn it is.

        Returns
        -------
        int
            Number of messages enqueued.
        """
        with self._database.read() as session:
            unended = job_sweep.unended(session)
        now = self._clock()
        self._since = {job: self._since.get(job, now) for job in unended}
        silent = [job for job in unended if now - self._since[job] >= self._patience(job)]
        if not silent:
            return 0
        expired = [job.id for job in silent if not job.claimable and self._expire(job)]
        claimable = sum(job.claimable for job in unended) + len(expired)
        lacking = claimable - self._queue.length()
        lost = [job for job in silent if job.claimable][: max(lacking - len(expired), 0)]
        marked = [job.id for job in lost if self._mark(job)]
        for job_id in (*expired, *marked):
            self._queue.enqueue(job_id)
        return len(expired) + len(marked)

    def _patience(self, job: Unended) -> float:
        if job.owner is None or job.claimable:
            return _QUIET_SECONDS
        return self._lease_seconds

    def _expire(self, job: Unended) -> bool:
        asked = self._clock()
        with self._database.write(durable=False) as session:
            if self._clock() - asked > _LATE_SECONDS:  # heartbeats may have waited for the same database
                self._since.clear()
                return False
            return job_sweep.expire(session, job)

    def _mark(self, job: Unended) -> bool:
        with self._database.write(durable=False) as session:
            return job_sweep.mark_enqueued(session, job, utc_now())
