"""The queue of job identifiers, which saves polling. A message may be lost or come twice: the job's row decides.

Its storage is one of Huey's, chosen by a URL: an SQLite file, Redis or PostgreSQL.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psycopg
from huey import Huey, PostgresHuey, RedisHuey, SqliteHuey  # type: ignore[import-untyped]
from huey.exceptions import ConfigurationError  # type: ignore[import-untyped]
from huey.registry import Message  # type: ignore[import-untyped]
from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

from store.errors import QueueURLError

_NAME = "spinewatch"
_BUSY_SECONDS = 5
_TABLES_LOCK = 0x5350494E45  # any number that no other program on the server uses


class JobQueue:
    """A queue of job identifiers; every process makes its own from the same URL.

    Parameters
    ----------
    url
        ``sqlite:///FILE``, ``redis://HOST:PORT/DB`` or ``postgresql://USER@HOST:PORT/DB``.
    handle
        What a worker does with an identifier; without it, identifiers can be enqueued only.

    Raises
    ------
    QueueURLError
        The URL cannot be used.
    """

    def __init__(self, url: str, handle: Callable[[str], None] | None = None) -> None:
        self.huey = _huey(url)

        def run_job(job_id: str) -> None:
            if handle is not None:
                handle(job_id)

        self._task = self.huey.task(name="run_job")(run_job)

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
            return RedisHuey(_NAME, url=url, **options)
        if backend == "postgresql":
            return _postgresql(parsed, options)
    except (ArgumentError, ConfigurationError, psycopg.OperationalError) as error:
        raise QueueURLError(
            f"the queue URL cannot be used ({type(error).__name__}); set SPINEWATCH_QUEUE_URL"
        ) from error
    raise QueueURLError(
        f"the queue URL begins with {backend!r}; set SPINEWATCH_QUEUE_URL to one that begins with sqlite:///,"
        " redis:// or postgresql://"
    )


def _sqlite(file: Path, options: dict[str, Any]) -> Huey:
    file.parent.mkdir(parents=True, exist_ok=True)
    # without fsync: a message lost with the machine's power is enqueued again
    return SqliteHuey(_NAME, filename=str(file), timeout=_BUSY_SECONDS, fsync=False, **options)


def _postgresql(url: URL, options: dict[str, Any]) -> Huey:
    dsn = url.set(drivername="postgresql").render_as_string(hide_password=False)
    # not blocking: Huey leaves the connection on which a thread listens open, and the consumer polls anyway
    options |= {"table_prefix": f"{_NAME}_queue", "create_tables": False, "blocking": False}
    huey = PostgresHuey(_NAME, dsn=dsn, **options)
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
