"""Whether the service can do its work now: named checks, each with its figure."""

from __future__ import annotations

import os
import shutil
import socket
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Literal
from uuid import uuid4

from sqlalchemy.exc import SQLAlchemyError

from contract.health import HealthCheck
from service.shared_run import SharedRun
from settings import Settings
from spinewatch.errors import SpinewatchError
from store import figures, processes
from store.database import Database, sqlite_path
from store.processes import MISSED_AFTER, ProcessKind
from store.queue import JobQueue
from store.revision import require_revision

_KEPT_SECONDS = 1.0
_LOCK_SECONDS = 3.0
"""Time that the test waits for other writers: who asks gives up soon, and what waits longer is not ready."""
_UNREADABLE = "unknown: the database cannot be read"

Name = Literal["database", "disk", "temporary-files", "queue", "queue-age", "workers"]


class ReadinessChecks:
    """The checks of a server. Requests that come together share one run."""

    def __init__(self, database: Database, queue: JobQueue, settings: Settings) -> None:
        self._database = database
        self._queue = queue
        self._settings = settings
        self._process_id = str(uuid4())
        self._process_name = f"{socket.gethostname()[:100]}:{os.getpid()}"
        self._run = SharedRun(lambda: list(self._checks()), _KEPT_SECONDS)

    async def results(self) -> list[HealthCheck]:
        """Return the checks, no older than a second."""
        return await self._run.result()

    def _checks(self) -> Iterator[HealthCheck]:
        yield self._write()
        path = sqlite_path(self._settings.database_url)
        if path is not None:
            yield _free("disk", path.parent, self._settings.min_free_bytes, "SPINEWATCH_MIN_FREE_BYTES")
        folder = Path(tempfile.gettempdir())
        yield _free("temporary-files", folder, 2 * self._settings.max_upload_bytes, "two uploads; set TMPDIR")
        yield self._messages()
        yield from self._record()

    def _write(self) -> HealthCheck:
        started = time.monotonic()
        try:
            require_revision(self._database)
            with self._database.write(lock_seconds=_LOCK_SECONDS) as session:
                processes.report(session, self._process_id, ProcessKind.SERVER, self._process_name)
        except (SQLAlchemyError, SpinewatchError) as error:
            reason = str(getattr(error, "orig", error)).partition("\n")[0]
            return _check("database", False, None, None, "s", f"a test cannot be written: {reason}")
        seconds = round(time.monotonic() - started, 3)
        return _check("database", True, seconds, None, "s", f"a test was written in {seconds} s")

    def _messages(self) -> HealthCheck:
        try:
            length = self._queue.length()
        except Exception as error:  # of whatever the queue is stored in
            return _check(
                "queue", False, None, None, "1", f"the queue does not answer ({type(error).__name__})"
            )
        return _check("queue", True, length, None, "1", f"{length} messages wait")

    def _record(self) -> Iterator[HealthCheck]:
        oldest = self._settings.max_queue_seconds
        try:
            with self._database.read() as session:
                age = round(figures.queue_seconds(session), 1)
                workers = len(processes.alive(session, ProcessKind.WORKER))
        except SQLAlchemyError:
            yield _check("queue-age", False, None, oldest, "s", _UNREADABLE)
            yield _check("workers", False, None, 1, "1", _UNREADABLE)
            return
        yield _check(
            "queue-age",
            age <= oldest,
            age,
            oldest,
            "s",
            f"the oldest queued job has waited {age} s; start more workers"
            if age > oldest
            else f"the oldest queued job has waited {age} s",
        )
        missed = (
            f"no worker has reported for {MISSED_AFTER.total_seconds():.0f} s; start one: spinewatch worker"
        )
        yield _check("workers", workers > 0, workers, 1, "1", f"{workers} workers run" if workers else missed)


def _free(name: Literal["disk", "temporary-files"], folder: Path, least: int, why: str) -> HealthCheck:
    try:
        free = shutil.disk_usage(folder).free
    except OSError as error:
        return _check(name, False, None, least, "By", f"{folder} cannot be used: {error.strerror}")
    found = f"{free / 1e6:.0f} MB are free in {folder}"
    detail = found if free >= least else f"{found}; free some, or see {why}"
    return _check(name, free >= least, free, least, "By", detail)


def _check(
    name: Name, ok: bool, figure: float | None, limit: float | None, unit: str, detail: str
) -> HealthCheck:
    return HealthCheck(
        name=name,
        ok=ok,
        figure=None if figure is None else float(figure),
        limit=None if limit is None else float(limit),
        unit=unit,
        detail=detail,
    )
