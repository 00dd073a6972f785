"""Whether an error means that the database could not be used now: the same transaction may succeed later."""

from __future__ import annotations

import sqlite3

from psycopg.errors import DiskFull, IdleInTransactionSessionTimeout, UndefinedColumn, UndefinedTable
from sqlalchemy.exc import DBAPIError, OperationalError, TimeoutError


def is_unavailable(error: BaseException) -> bool:
    """Return whether an error comes from a database that was busy, cut off or stopped, not from what was asked of it.

    Nothing of the transaction is stored, except when the connection was lost during the commit itself: then it is
    stored as a whole or not at all, and nobody knows which.

    Parameters
    ----------
    error
        An error of a transaction.

    Returns
    -------
    bool
        Whether trying again makes sense.
    """
    if tables_are_missing(error):
        return False
    if isinstance(error, OperationalError | TimeoutError):
        return True
    return isinstance(error, DBAPIError) and (
        error.connection_invalidated or isinstance(error.orig, IdleInTransactionSessionTimeout)
    )


def disk_is_full(error: BaseException) -> bool:
    """Return whether an error says that the database has no room on its disk: somebody has to make some.

    Parameters
    ----------
    error
        An error of a transaction.

    Returns
    -------
    bool
        Whether the disk is full.
    """
    if not isinstance(error, DBAPIError):
        return False
    if isinstance(error.orig, sqlite3.OperationalError):
        return getattr(error.orig, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
    return isinstance(error.orig, DiskFull)


def tables_are_missing(error: BaseException) -> bool:
    """Return whether an error says that the database lacks a table or a column: trying again makes no sense.

    Parameters
    ----------
    error
        An error of a transaction.

    Returns
    -------
    bool
        Whether the database is not that of this version.
    """
    if not isinstance(error, DBAPIError):
        return False
    if isinstance(error.orig, sqlite3.OperationalError):
        return getattr(error.orig, "sqlite_errorcode", None) == sqlite3.SQLITE_ERROR
    return isinstance(error.orig, UndefinedTable | UndefinedColumn)
