"""The database and the queue of tests: SQLite files, or PostgreSQL and Redis with TEST_DATABASE=postgresql.

PostgreSQL is a server of the tests' own, or the one at TEST_POSTGRESQL_URL.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import signal
import socket
import sqlite3
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from functools import cache
from pathlib import Path
from typing import Any
from uuid import uuid4

import psycopg
import pytest
from sqlalchemy import make_url

from migrations.history import upgrade
from store.database import sqlite_path
from store.postgresql import WRITE_LOCK
from tests.patience import PATIENCE_S
from tests.postgresql_server import postgresql_server, programs

DATABASE = os.environ.get("TEST_DATABASE", "sqlite")
INTEGRITY_ERRORS = (sqlite3.IntegrityError, psycopg.errors.IntegrityError)

about_the_sqlite_file = pytest.mark.skipif(
    DATABASE != "sqlite", reason="is about the file of an SQLite database"
)

_PR_SET_PDEATHSIG = 1

_session = ExitStack()
"""What lives as long as the session of tests: the server of PostgreSQL and the template of its databases."""


def end_session() -> None:
    """End what lives as long as the session of tests."""
    _session.close()
    _postgresql.cache_clear()
    _template.cache_clear()


@contextmanager
def new_database(
    folder: Path, *, tables: bool = True, name: str = "database", storage: str = DATABASE
) -> Iterator[str]:
    """Give the URL of a new database of the test's own, with the tables of this version or with none."""
    if storage == "sqlite":
        url = f"sqlite:///{folder / f'{name}.sqlite'}"
        if tables:
            upgrade(url)
        yield url
        return
    database = _create(f" TEMPLATE {_template()}" if tables else "")
    try:
        yield _url_of(database)
    finally:
        _drop(database)


def require_postgresql() -> None:
    """Skip the test where PostgreSQL is not installed; with TEST_DATABASE=postgresql, that is an error."""
    if DATABASE != "postgresql" and "TEST_POSTGRESQL_URL" not in os.environ and programs() is None:
        pytest.skip("PostgreSQL is not installed")


@contextmanager
def new_queue(folder: Path, database_url: str) -> Iterator[str]:
    """Give the URL of a new queue for a database: its file beside it, or a Redis server of the test's own."""
    file = sqlite_path(database_url)
    if file is not None:
        yield f"sqlite:///{file.with_name(f'{file.stem}-queue.sqlite')}"
    elif shutil.which("redis-server") is None:
        yield database_url
    else:
        with new_redis(folder) as url:
            yield url


@contextmanager
def new_redis(folder: Path) -> Iterator[str]:
    """Give the URL of a Redis server of the test's own."""
    with _redis(folder / f"redis-{uuid4().hex[:8]}.sock") as url:
        yield url


def run_sql(database_url: str, statement: str, *values: Any, commit: bool = False) -> list[tuple[Any, ...]]:
    """Run a statement past the service; its parameters are question marks, and SQLite checks no foreign keys."""
    with closing(_connect(database_url)) as connection:
        if sqlite_path(database_url) is None:
            statement = statement.replace("%", "%%").replace("?", "%s")
        cursor = connection.execute(statement, values)
        rows: list[tuple[Any, ...]] = cursor.fetchall() if cursor.description else []
        if commit:
            connection.commit()
    return rows


@contextmanager
def fault(database_url: str, table: str, condition: str = "") -> Iterator[None]:
    """Make the database reject new rows of a table, as on a full disk; a condition names the column as NEW.column."""
    when = f" WHEN ({condition})" if condition else ""
    if sqlite_path(database_url) is not None:
        make = [
            f"CREATE TRIGGER fault BEFORE INSERT ON {table}{when} BEGIN SELECT RAISE(ABORT, 'fault'); END"
        ]
        undo = ["DROP TRIGGER fault"]
    else:
        body = "BEGIN RAISE EXCEPTION 'fault' USING ERRCODE = 'integrity_constraint_violation'; END"
        make = [
            f"CREATE FUNCTION fault() RETURNS trigger LANGUAGE plpgsql AS '{body.replace(chr(39), 2 * chr(39))}'",
            f"CREATE TRIGGER fault BEFORE INSERT ON {table} FOR EACH ROW{when} EXECUTE FUNCTION fault()",
        ]
        undo = [f"DROP TRIGGER fault ON {table}", "DROP FUNCTION fault"]
    for statement in make:
        run_sql(database_url, statement, commit=True)
    try:
        yield
    finally:
        for statement in undo:
            run_sql(database_url, statement, commit=True)


@contextmanager
def held_write_lock(database_url: str) -> Iterator[None]:
    """Hold the write lock of a database, as another program would."""
    file = sqlite_path(database_url)
    if file is None:
        with closing(_connect(database_url)) as other:
            other.execute(f"SELECT pg_advisory_xact_lock({WRITE_LOCK})")
            yield
        return
    with closing(sqlite3.connect(file, timeout=30, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        yield
        other.execute("ROLLBACK")


def everything_stored(database_url: str) -> bytes:
    """Return all bytes of a database: the files of SQLite, or every row of PostgreSQL as text, images as they are."""
    file = sqlite_path(database_url)
    if file is not None:
        return b"".join(path.read_bytes() for path in file.parent.glob(f"{file.name}*"))
    tables = run_sql(database_url, "SELECT tablename FROM pg_tables WHERE schemaname = current_schema()")
    queries = [f"SELECT t::text FROM {table} t" for (table,) in tables]  # noqa: S608 - our own names
    rows = [text for query in queries for (text,) in run_sql(database_url, query)]
    images = [content for (content,) in run_sql(database_url, "SELECT content FROM images")]
    return b"\n".join([*(row.encode() for row in rows), *map(bytes, images)])


def write_lock_is_free(url: str) -> bool:
    """Return whether no process is inside a transaction that writes, in a database or a queue at a URL."""
    backend = make_url(url).get_backend_name()
    if backend == "postgresql":
        query = "SELECT count(*) FROM pg_locks JOIN pg_database ON database = pg_database.oid"
        query += " WHERE locktype = 'advisory' AND datname = current_database()"
        return run_sql(url, query) == [(0,)]
    if backend != "sqlite":
        return True
    connection = sqlite3.connect(str(sqlite_path(url)), timeout=0.2, isolation_level=None)
    try:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("ROLLBACK")
    except sqlite3.OperationalError:
        return False
    finally:
        connection.close()
    return True


def _connect(url: str) -> Any:
    file = sqlite_path(url)
    if file is not None:
        return sqlite3.connect(file, timeout=PATIENCE_S)
    return psycopg.connect(make_url(url).set(drivername="postgresql").render_as_string(hide_password=False))


@cache
def _postgresql() -> str:
    """Return the URL of the PostgreSQL server, which is started when a test first needs it."""
    if "TEST_POSTGRESQL_URL" in os.environ:
        return os.environ["TEST_POSTGRESQL_URL"].replace("+psycopg", "")
    folder = programs()
    assert folder is not None, "PostgreSQL is not installed (Debian: apt install postgresql)"
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    return _session.enter_context(postgresql_server(folder, port))


def _server() -> psycopg.Connection[Any]:
    return psycopg.connect(_postgresql(), autocommit=True, connect_timeout=int(PATIENCE_S))


def _url_of(database: str) -> str:
    return make_url(_postgresql()).set(database=database).render_as_string(hide_password=False)


def _create(options: str = "") -> str:
    name = f"spinewatch_test_{uuid4().hex[:12]}"
    with closing(_server()) as server:
        server.execute(f"CREATE DATABASE {name}{options}")
    return name


def _drop(name: str) -> None:
    with closing(_server()) as server:
        server.execute(f"DROP DATABASE IF EXISTS {name} WITH (FORCE)")


@cache
def _template() -> str:
    """Return the name of a database with the tables of this version, which is made once per session."""
    name = _create()
    _session.callback(_drop, name)
    upgrade(_url_of(name))
    return name


@contextmanager
def _redis(socket: Path) -> Iterator[str]:
    options = ["--port", "0", "--unixsocket", str(socket), "--save", "", "--appendonly", "no"]
    server = subprocess.Popen(
        ["redis-server", *options],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        preexec_fn=_die_with_parent,  # noqa: PLW1509 - the tests' process has one thread here
    )
    try:
        end = time.monotonic() + PATIENCE_S
        while not socket.exists():
            assert server.poll() is None, "the Redis server ended"
            assert time.monotonic() < end, "the Redis server does not start"
            time.sleep(0.01)
        yield f"unix://{socket}"
    finally:
        server.terminate()
        server.wait()


def _die_with_parent() -> None:
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
