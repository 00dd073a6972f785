"""The database: its engine, and sessions that read or write."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, make_url
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from store.errors import DatabaseNotReadyError

_BUSY_SECONDS = 10
_to_json = partial(json.dumps, allow_nan=False, separators=(",", ":"))


class Database:
    """The one database, which holds everything; one per process, closed at the end.

    SQLite runs in WAL mode with foreign keys on, and every commit is synced to the disk. A write transaction takes the
    write lock at its start: a deferred one that reads first may fail when it writes.

    Parameters
    ----------
    url
        SQLAlchemy URL.

    Raises
    ------
    DatabaseNotReadyError
        The URL cannot be used.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self.engine = _engine(url)
        self._read_engine = self.engine
        if (
            self.engine.dialect.name == "postgresql"
        ):  # its default isolation shows what others commit meanwhile
            self._read_engine = self.engine.execution_options(isolation_level="REPEATABLE READ")
        self._write_engine = self.engine.execution_options(spinewatch_writes=True)

    @contextmanager
    def read(self) -> Iterator[Session]:
        """Open a session that sees one state of the database and writes nothing.

        Yields
        ------
        Session
            The session.
        """
        with Session(self._read_engine, autoflush=False, expire_on_commit=False) as session:
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """Open a session whose changes are committed together at the end, or not at all.

        Yields
        ------
        Session
            The session.
        """
        with Session(self._write_engine, expire_on_commit=False) as session, session.begin():
            yield session

    def close(self) -> None:
        """Close every connection."""
        self.engine.dispose()


def sqlite_path(url: str) -> Path | None:
    """Return the file of an SQLite URL.

    Parameters
    ----------
    url
        SQLAlchemy URL.

    Returns
    -------
    Path or None
        The file, None for any other database.
    """
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite" or not parsed.database or parsed.database == ":memory:":
        return None
    return Path(parsed.database)


def _engine(url: str) -> Engine:
    try:
        backend = make_url(url).get_backend_name()
        if backend != "sqlite":
            return create_engine(url, json_serializer=_to_json)
        engine = create_engine(
            url,
            json_serializer=_to_json,
            connect_args={"timeout": _BUSY_SECONDS},
            max_overflow=-1,  # one connection per thread; a file has no limit of its own
        )
    except (SQLAlchemyError, ImportError) as error:
        raise DatabaseNotReadyError(
            f"the database URL cannot be used ({type(error).__name__}); set SPINEWATCH_DATABASE_URL"
        ) from error
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _prepare_sqlite(connection: DBAPIConnection, _: Any) -> None:
    connection.isolation_level = None  # transactions begin in _begin_sqlite
    cursor = connection.cursor()
    for pragma in ("journal_mode=WAL", "foreign_keys=ON", "synchronous=FULL"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _begin_sqlite(connection: Connection) -> None:
    writes = connection.get_execution_options().get("spinewatch_writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")
