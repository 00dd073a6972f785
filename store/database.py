"""The database: its engine, and sessions that read or write."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from store import postgresql
from store.commits import Commits
from store.errors import DatabaseNotReadyError
from store.json_text import to_json

_BUSY_SECONDS = 10
_OWNER_ONLY = 0o600
_LEVEL = "spinewatch_synchronous"
_LOCK_SECONDS = "spinewatch_lock_seconds"


class Database:
    """The one database, which holds everything; one per process, closed at the end.

    SQLite runs in WAL mode with foreign keys on, and every commit is synced to the disk. A write transaction takes the
    write lock at its start, on SQLite the file's and on PostgreSQL an advisory one: a deferred one that reads first may
    fail when it writes.

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
        if self.engine.dialect.name == "postgresql":  # by default it shows what others commit meanwhile
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
    def write(
        self, *, patient: bool = False, durable: bool = True, lock_seconds: float | None = None
    ) -> Iterator[Session]:
        """Open a session whose changes are committed together at the end, or not at all.

        Parameters
        ----------
        patient
            Wait for other writers, and work, without a limit of time where the database is a server: for migrations,
            which several hosts may start at once.
        durable
            Whether the commit survives a power cut from the moment at which it ends, as what a client is told must.
            Otherwise it does so from the next durable one on, or is lost as a whole. An ended process loses neither.
        lock_seconds
            Longest time to wait for other writers, s; None for the usual one.

        Yields
        ------
        Session
            The session.
        """
        engine = self._write_engine.execution_options(
            spinewatch_patient=patient, spinewatch_durable=durable, spinewatch_lock_seconds=lock_seconds
        )
        with Session(engine, expire_on_commit=False) as session, session.begin():
            yield session

    def checkpoint(self, seconds: float = 1.0) -> bool:
        """Write everything that is committed into the one file, so that a plain copy of it is whole.

        Only for the orderly end of a process: others may go on and write again. Databases on a server need none.

        Parameters
        ----------
        seconds
            Longest time to wait for others that read or write.

        Returns
        -------
        bool
            Whether the file was whole at that moment.
        """
        path = sqlite_path(self.url)
        if path is None:
            return True
        uri = f"{path.resolve().as_uri()}?mode=rw"
        try:
            with closing(sqlite3.connect(uri, uri=True, isolation_level=None, timeout=seconds)) as connection:
                busy, *_ = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
        except (
            sqlite3.Error
        ):  # the file is not there, broken or on a full disk: the log keeps what is committed
            return False
        return not busy

    def commits(self) -> Commits:
        """Return what tells whether an event was committed.

        Returns
        -------
        Commits
            To be asked by one thread at a time.
        """
        return Commits(sqlite_path(self.url))

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


def create_private(path: Path) -> None:
    """Create a file that only its owner can read, or make one that exists so.

    SQLite gives the files that it makes beside a database the same mode.

    Parameters
    ----------
    path
        The file; its folder is created too.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    os.close(os.open(path, os.O_CREAT | os.O_RDWR, _OWNER_ONLY))
    for file in (path, path.with_name(f"{path.name}-wal"), path.with_name(f"{path.name}-shm")):
        with suppress(FileNotFoundError):
            if file.stat().st_mode & 0o777 & ~_OWNER_ONLY:
                file.chmod(_OWNER_ONLY)


def _engine(url: str) -> Engine:
    try:
        parsed = make_url(url)
        if parsed.get_backend_name() == "postgresql":
            return _postgresql_engine(parsed)
        engine = create_engine(
            url,
            json_serializer=to_json,
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


def _postgresql_engine(url: URL) -> Engine:
    options = postgresql.connection_options(url)
    engine = create_engine(url, json_serializer=to_json, connect_args=options, **postgresql.POOL)
    event.listen(engine, "connect", postgresql.prepare)
    event.listen(engine, "begin", postgresql.begin)
    return engine


def _prepare_sqlite(connection: DBAPIConnection, _: Any) -> None:
    connection.isolation_level = None  # transactions begin in _begin_sqlite
    cursor = connection.cursor()
    for pragma in ("journal_mode=WAL", "foreign_keys=ON", "synchronous=FULL"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()


def _begin_sqlite(connection: Connection) -> None:
    options = connection.get_execution_options()
    if not options.get("spinewatch_writes", False):
        connection.exec_driver_sql("BEGIN")
        return
    level = "FULL" if options.get("spinewatch_durable", True) else "NORMAL"
    if connection.info.setdefault(_LEVEL, "FULL") != level:
        connection.exec_driver_sql(f"PRAGMA synchronous={level}")
        connection.info[_LEVEL] = level
    seconds = options.get(_LOCK_SECONDS) or _BUSY_SECONDS
    if connection.info.setdefault(_LOCK_SECONDS, _BUSY_SECONDS) != seconds:
        connection.exec_driver_sql(f"PRAGMA busy_timeout={int(1000 * seconds)}")
        connection.info[_LOCK_SECONDS] = seconds
    connection.exec_driver_sql("BEGIN IMMEDIATE")
