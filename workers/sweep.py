"""The sweep: rings again for jobs that wait unrung, so that nothing depends on a bell that was lost."""

from __future__ import annotations

from datetime import datetime, timedelta

from store import jobs
from store.database import Database
from store.queue import JobQueue

_QUIET = timedelta(seconds=2)  # a job that was rung so recently may be about to be claimed


def sweep(record: Database, bell: JobQueue, now: datetime) -> int:
    """Ring for queued jobs and expired leases that nobody rang for lately; return how many were rung.

    A job whose ring still waits in the queue is left alone, or a backlog would multiply.
    """
    with record.reading() as session:
        unrung = jobs.unrung(session, now, _QUIET)
    if not unrung:
        return 0
    waiting = bell.waiting()
    rung = 0
    for job_id in unrung:
        if job_id in waiting:
            continue
        with record.writing() as session:
            ours = jobs.note_ring(session, job_id, now, _QUIET)
        if ours:
            bell.ring(job_id)
            rung += 1
    return rung
