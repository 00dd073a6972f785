"""One attempt at a job: extends its lease and stores its progress."""

from __future__ import annotations

import time
from collections.abc import Mapping
from datetime import timedelta

from sqlalchemy.exc import SQLAlchemyError

from store import leases
from store.clock import utc_now
from store.database import Database
from store.leases import Lease
from store.unavailable import is_unavailable
from workers.step_clock import StepClock

_MIN_SECONDS_BETWEEN_WRITES = 0.1
"""A job that is done sooner stores no progress."""


class LeaseLostError(Exception):
    """The job was cancelled or another worker has claimed it: stop, and write nothing."""


class Attempt:
    """One attempt at a job; used by the thread that works and by the one that sends heartbeats.

    Parameters
    ----------
    database
        The database.
    lease
        The lease on the job.
    lease_for
        Duration of the lease from each heartbeat.
    """

    def __init__(self, database: Database, lease: Lease, lease_for: timedelta) -> None:
        self.lease = lease
        self._database = database
        self._lease_for = lease_for
        self._started = self._written = time.monotonic()  # the claim has just been written
        self._fraction = 0.0
        self._step: str | None = None
        self._lost = False
        self._steps = StepClock()

    @property
    def seconds(self) -> float:
        """Time since the attempt began, s."""
        return time.monotonic() - self._started

    def step_seconds(self) -> Mapping[str, float]:
        """Return the time that each step has taken until now.

        Returns
        -------
        mapping of str to float
            Time by step, s.
        """
        return self._steps.seconds()

    def progress(self, step: str, fraction: float) -> None:
        """Store the step that begins, as a ``Progress`` callback.

        Parameters
        ----------
        step
            Name of the step.
        fraction
            Fraction of the work done before it, 0 to 1.

        Raises
        ------
        LeaseLostError
            The lease is lost.
        """
        self._steps.begin(step)
        self._step, self._fraction = step, fraction
        if time.monotonic() - self._written >= _MIN_SECONDS_BETWEEN_WRITES:
            try:
                self.heartbeat()
            except SQLAlchemyError as error:
                if not is_unavailable(error):
                    raise  # else the work goes on: the thread of heartbeats tries again
        self.check()

    def check(self) -> None:
        """Check that the work is still wanted, as of the last heartbeat.

        Raises
        ------
        LeaseLostError
            The lease is lost.
        """
        if self._lost:
            raise LeaseLostError

    def heartbeat(self) -> None:
        """Extend the lease."""
        self._written = time.monotonic()
        with self._database.write(durable=False) as session:
            held = leases.heartbeat(
                session, self.lease, utc_now() + self._lease_for, self._fraction, self._step
            )
        self._lost = self._lost or not held
