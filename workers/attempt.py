"""One attempt at a job: keeps its lease alive and tells how far it is."""

from __future__ import annotations

import time
from datetime import timedelta

from store import jobs
from store.clock import utc_now
from store.database import Database
from store.jobs import Lease

_LEAST_SECONDS_BETWEEN_NOTES = 0.1


class LeaseLostError(Exception):
    """The job was cancelled or another worker has it: stop, and write nothing."""


class Attempt:
    """Used by the thread that works and the one that beats; both may prolong the lease."""

    def __init__(self, record: Database, lease: Lease, lease_for: timedelta) -> None:
        self.lease = lease
        self._record = record
        self._lease_for = lease_for
        self._started = time.monotonic()
        self._noted = 0.0
        self._progress = 0.0
        self._step: str | None = None
        self._lost = False

    @property
    def seconds(self) -> float:
        """How long the attempt has run."""
        return time.monotonic() - self._started

    def note(self, step: str, progress: float) -> None:
        """Note the step that begins; raise ``LeaseLostError`` when going on makes no sense."""
        self._step, self._progress = step, progress
        if time.monotonic() - self._noted >= _LEAST_SECONDS_BETWEEN_NOTES:
            self.beat()
        if self._lost:
            raise LeaseLostError

    def beat(self) -> None:
        """Prolong the lease."""
        self._noted = time.monotonic()
        with self._record.writing() as session:
            held = jobs.extend(session, self.lease, utc_now() + self._lease_for, self._progress, self._step)
        self._lost = self._lost or not held
