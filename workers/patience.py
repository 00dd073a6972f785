"""Transactions that are repeated while the database is held or away: what was measured is not lost to a pause."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import structlog

from store.errors import DatabaseNotReadyError
from store.unavailable import is_unavailable, tables_are_missing

Answer = TypeVar("Answer")

_PAUSE_SECONDS = 0.5
_log = structlog.get_logger("worker")


def patiently(action: Callable[[], Answer], seconds: float) -> Answer:
    """Run a transaction, again and again while the database cannot be used.

    Parameters
    ----------
    action
        The transaction; it changes nothing when it fails.
    seconds
        Time after which the error of the last try is raised.

    Returns
    -------
    Answer
        What the action returns.

    Raises
    ------
    DatabaseNotReadyError
        The database lacks a table or a column.
    """
    deadline = time.monotonic() + seconds
    while True:
        try:
            return action()
        except Exception as error:
            if tables_are_missing(error):
                raise DatabaseNotReadyError(
                    "the database has not the tables of this version; run: spinewatch db upgrade, and the job again"
                ) from error
            if not is_unavailable(error) or time.monotonic() > deadline:
                raise
            _log.warning("database_unavailable", error=str(getattr(error, "orig", error)).partition("\n")[0])
        time.sleep(_PAUSE_SECONDS)
