"""The sweep: enqueues stalled jobs again, so that no job depends on a message that was lost."""

from __future__ import annotations

from datetime import datetime, timedelta

from store import jobs
from store.database import Database
from store.queue import JobQueue

_QUIET = timedelta(seconds=2)  # a job that was enqueued so recently may be about to be claimed


def sweep(database: Database, queue: JobQueue, now: datetime) -> int:
    """Enqueue stalled jobs again: queued ones, and running ones whose lease has expired.

    A job whose message still waits in the queue is left alone, or a backlog would multiply.

    Parameters
    ----------
    database
        The database.
    queue
        The queue.
    now
        The time.

    Returns
    -------
    int
        Number of jobs enqueued.
    """
    with database.read() as session:
        stalled = jobs.stalled(session, now, _QUIET)
    if not stalled:
        return 0
    waiting = queue.waiting()
    count = 0
    for job_id in stalled:
        if job_id in waiting:
            continue
        with database.write() as session:
            marked = jobs.mark_enqueued(session, job_id, now, _QUIET)
        if marked:
            queue.enqueue(job_id)
            count += 1
    return count
