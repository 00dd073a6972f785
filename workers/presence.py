"""The report of a worker process that it runs, for health checks and metrics."""

from __future__ import annotations

from uuid import uuid4

import structlog
from sqlalchemy.exc import SQLAlchemyError

from store import processes
from store.database import Database
from store.processes import ProcessKind

_log = structlog.get_logger("worker")


class Presence:
    """Reports that this process runs until it ends.

    Parameters
    ----------
    database
        The database.
    name
        Host and number of the process.
    """

    def __init__(self, database: Database, name: str) -> None:
        self._database = database
        self._name = name
        self._id = str(uuid4())

    def report(self) -> None:
        """Report; called from time to time."""
        with self._database.write(durable=False) as session:
            processes.report(session, self._id, ProcessKind.WORKER, self._name)

    def end(self) -> None:
        """Report the orderly end, after which nobody misses the process."""
        try:
            with self._database.write() as session:
                processes.forget(session, self._id)
        except SQLAlchemyError:  # it is missed for a day instead
            _log.warning("end_not_reported")
