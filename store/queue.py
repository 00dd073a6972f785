"""The queue of job identifiers, which saves polling. A message may be lost or come twice: the job's row decides.

Its storage is one of Huey's, chosen by a URL: an SQLite file, Redis or PostgreSQL.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import psycopg
from huey import Huey, PostgresHuey, RedisHuey  # type: ignore[import-untyped]
from huey.exceptions import ConfigurationError  # type: ignore[import-untyped]
from huey.registry import Message  # type: ignore[import-untyped]
from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from store import postgresql
from store.errors import QueueURLError
from store.queue_file import QueueFile

_NAME = "spinewatch"
TABLE_PREFIX = f"{_NAME}_queue"
"""What the names of the queue's tables begin with in a PostgreSQL database, which may be the record's own."""

_BUSY_SECONDS = 5
_TABLES_LOCK = 0x5350494E45  # any number that no other program on the server uses


class JobQueue:
    """A queue of job identifiers; every process makes its own from the same URL.

    Parameters
    ----------
    url
        ``sqlite:///FILE``, ``redis://HOST:PORT/DB`` or ``postgresql://USER@HOST:PORT/DB``.
    handle
        What a worker does with an identifier; it may return identifiers to enqueue next. Without it, identifiers can
        be enqueued only.

    Raises
    ------
    QueueURLError
        The URL cannot be used.
    """

    def __init__(self, url: str, handle: Callable[[str], Iterable[str] | None] | None = None) -> None:
        self.huey = _huey(url)

        def run_job(job_id: str) -> None:
            if handle is not None:
                for next_id in handle(job_id) or ():
                    self.enqueue(next_id)

        self._task = self.huey.task(name="run_job")(run_job)

    @property
    def is_file(self) -> bool:
        """Whether the queue is a file of this machine."""
        return isinstance(self.huey.storage, QueueFile)

    def enqueue(self, job_id: str) -> None:
        """Append a job to the queue.

        Parameters
        ----------
        job_id
            Identifier of the job.
        """
        self._task(job_id)

    def waiting(self) -> set[str]:
        """Return the jobs that no worker has taken from the queue.

        Returns
        -------
        set of str
            Their identifiers.
        """
        return {task.args[0] for task in self.huey.pending()}

    def length(self) -> int:
        """Return the number of messages that no worker has taken from the queue.

        Returns
        -------
        int
            The number; a job may have more than one.
        """
        return int(self.huey.pending_count())

    def close(self) -> None:
        """Close the connections."""
        storage = self.huey.storage
        storage.close()
        if isinstance(self.huey, RedisHuey):
            storage.pool.disconnect()


def _huey(url: str) -> Huey:
    options: dict[str, Any] = {"results": False, "serializer": _JsonSerializer()}
    try:
        parsed = make_url(url)
        backend = parsed.get_backend_name()
        if backend == "sqlite" and parsed.database:
            return _sqlite(Path(parsed.database), options)
        if backend in {"redis", "rediss", "unix"}:
            return _redis(url, options)
        if backend == "postgresql":
            return _postgresql(parsed, options)
    except (OSError, sqlite3.Error) as error:
        raise QueueURLError(
            f"the file of the queue cannot be used: {_reason(error)}; check it, its folder and SPINEWATCH_QUEUE_URL"
        ) from error
    except (ArgumentError, ConfigurationError, psycopg.OperationalError) as error:
        raise QueueURLError(
            f"the queue URL cannot be used ({type(error).__name__}); set SPINEWATCH_QUEUE_URL"
        ) from error
    raise QueueURLError(
        f"the queue URL begins with {backend!r}; set SPINEWATCH_QUEUE_URL to one that begins with sqlite:///,"
        " redis:// or postgresql://"
    )


def _reason(error: Exception) -> str:
    return f"{error.strerror}: {error.filename}" if isinstance(error, OSError) else str(error)


def _sqlite(file: Path, options: dict[str, Any]) -> Huey:
    # without fsync: a message lost with the machine's power is enqueued again
    storage = {"storage_class": QueueFile, "filename": str(file), "timeout": _BUSY_SECONDS, "fsync": False}
    return Huey(_NAME, **storage, **options)


def _redis(url: str, options: dict[str, Any]) -> Huey:
    from redis import ConnectionPool  # noqa: PLC0415 - only this storage needs it
    from redis.backoff import NoBackoff  # noqa: PLC0415
    from redis.retry import Retry  # noqa: PLC0415

    limits = {} if url.startswith("unix") else {"socket_connect_timeout": 2, "socket_keepalive": True}
    # a worker waits one second for a message: a server that is silent for longer is cut off. A connection that the
    # server closed is opened again at once; what fails then is left to the sweep: no request waits for the queue
    once_more = Retry(NoBackoff(), 1)
    pool = ConnectionPool.from_url(
        url, socket_timeout=2.5, health_check_interval=10, retry=once_more, **limits
    )
    return RedisHuey(_NAME, connection_pool=pool, **options)


def _postgresql(url: URL, options: dict[str, Any]) -> Huey:
    dsn = url.set(drivername="postgresql").render_as_string(hide_password=False)

    def connect() -> psycopg.Connection[Any]:
        connection = psycopg.connect(dsn, **postgresql.connection_options(url))
        postgresql.prepare(connection)
        return connection

    # not blocking: Huey leaves the connection on which a thread listens open, and the consumer polls anyway
    options |= {"table_prefix": TABLE_PREFIX, "create_tables": False, "blocking": False}
    huey = PostgresHuey(_NAME, connection=connect, **options)
    # CREATE TABLE IF NOT EXISTS fails when processes start together, so they take turns
    huey.storage.conn.execute("SELECT pg_advisory_lock(%s)", (_TABLES_LOCK,))
    huey.storage.initialize_schema()  # closes the connection, which releases the lock
    return huey


class _JsonSerializer:
    """Messages as JSON: the default is pickle, which runs code from what it reads."""

    def serialize(self, message: Message) -> bytes:
        return json.dumps(message).encode()

    def deserialize(self, data: bytes) -> Message:
        return Message(*json.loads(data))
