"""PostgreSQL: connections that notice a lost server, and writers that take turns as on SQLite."""

from __future__ import annotations

from typing import Any

import psycopg
from sqlalchemy import URL, Connection

POOL = {"pool_size": 5, "max_overflow": 15, "pool_timeout": 10.0, "pool_pre_ping": True}
"""Options of the engine: at most 20 connections per process, each tried before it is used again."""

WRITE_LOCK = 0x5350494E5752
"""Number of the advisory lock of writers: any that no other program uses in this database."""

_CONNECTION = {
    "connect_timeout": "5",
    "keepalives_idle": "5",
    "keepalives_interval": "2",
    "keepalives_count": "3",
    "tcp_user_timeout": "10000",
    "application_name": "spinewatch",
}
_SESSION = {
    "lock_timeout": "10s",
    "statement_timeout": "30s",
    "idle_in_transaction_session_timeout": "15s",
    "tcp_keepalives_idle": "5",
    "tcp_keepalives_interval": "2",
    "tcp_keepalives_count": "3",
    "tcp_user_timeout": "10000",
    "client_connection_check_interval": "2000",
}


def connection_options(url: URL) -> dict[str, Any]:
    """Return what is passed to the driver for each connection, so that a server that is cut off is noticed in seconds.

    Parameters
    ----------
    url
        URL of the database; what its query sets is left as it is.

    Returns
    -------
    dict
        Parameters of libpq.
    """
    return {name: value for name, value in _CONNECTION.items() if name not in url.query}


def prepare(connection: psycopg.Connection[Any], record: Any = None) -> None:
    """Set up a new connection: nothing waits without end, and the server notices a client that is cut off.

    Without these limits, a client that is gone would keep the write lock until TCP gives up, after hours.

    Parameters
    ----------
    connection
        The driver's connection.
    record
        Not used; an event of the pool of connections has it.
    """
    autocommit, connection.autocommit = connection.autocommit, True
    settings = ", ".join(f"set_config('{name}', '{value}', false)" for name, value in _SESSION.items())
    connection.execute(f"SELECT {settings}")
    connection.autocommit = autocommit


def begin(connection: Connection) -> None:
    """Take the lock of writers at the start of a transaction that writes; its end releases the lock.

    So a transaction that reads before it writes sees what all earlier writers have stored, numbers of events are in
    the order of their commits, and no two writers wait for each other.

    Parameters
    ----------
    connection
        The connection whose transaction begins.
    """
    options = connection.get_execution_options()
    if not options.get("spinewatch_writes", False):
        return
    if options.get("spinewatch_patient", False):
        connection.exec_driver_sql(
            "SELECT set_config('lock_timeout', '0', true), set_config('statement_timeout', '0', true),"
            " set_config('idle_in_transaction_session_timeout', '0', true)"
        )
    lock_seconds = options.get("spinewatch_lock_seconds")
    if lock_seconds is not None:
        connection.exec_driver_sql(f"SET LOCAL lock_timeout = {int(1000 * lock_seconds)}")
    if not options.get("spinewatch_durable", True):
        connection.exec_driver_sql("SET LOCAL synchronous_commit = off")
    connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({WRITE_LOCK})")
