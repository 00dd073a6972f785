"""The thread that takes job identifiers from the queue: Huey's consumer with one worker."""

from __future__ import annotations

from store.queue import JobQueue

_POLL_SECONDS = 0.01
_FILE_POLL_SECONDS = 0.005
"""A file beside the database is asked in microseconds."""


class Consumer:
    """Takes job identifiers from a queue in a thread and handles them, one at a time.

    Parameters
    ----------
    queue
        A queue with a ``handle``.
    """

    def __init__(self, queue: JobQueue) -> None:
        pause = _FILE_POLL_SECONDS if queue.is_file else _POLL_SECONDS
        self._consumer = queue.huey.create_consumer(
            workers=1,
            periodic=False,
            initial_delay=pause,
            max_delay=pause,
            backoff=1.0,
            check_worker_health=False,
        )
        self._consumer.start()
        (_, self._thread), *_ = self._consumer.worker_threads

    @property
    def alive(self) -> bool:
        """Whether the thread runs."""
        return bool(self._thread.is_alive())

    def stop(self, seconds: float) -> bool:
        """Stop the thread after its current job.

        Parameters
        ----------
        seconds
            Time to wait for the job to end.

        Returns
        -------
        bool
            Whether the thread has ended.
        """
        self._consumer.stop_flag.set()
        self._thread.join(seconds)
        return not self.alive
