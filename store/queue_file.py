"""The queue in an SQLite file, which is replaced when it is broken: the database has every job that it named."""

from __future__ import annotations

import fcntl
import os
import re
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import structlog
from huey.storage import SqliteStorage  # type: ignore[import-untyped]

from store.database import create_private
from store.errors import QueueURLError

Answer = TypeVar("Answer")

_BROKEN = frozenset({sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB})
_PRIMARY_CODE = 0xFF
_HEADER = b"SQLite format 3\0"
_TABLES = frozenset({"kv", "schedule", "task", "counter"})
_DEFINITION = re.compile(rb"CREATE (?:VIRTUAL )?TABLE [\"'`\[]?([^\x00-\x20\"'`\](]+)[\s\"'`\](]")
_LONGEST_DEFINITION = 256
"""Bytes of a definition of a table that are enough to find its name."""

_PAGE = 4096
_FIRST_BYTES = frozenset(b"\x00\x02\x05\x0a\x0d")
"""What a page of an SQLite file may begin with, the first page aside."""

_BLOCK = 256 * _PAGE
_log = structlog.get_logger("queue")


class QueueFile(SqliteStorage):  # type: ignore[misc]
    """Huey's storage in an SQLite file that may break or be replaced at any time.

    The file is written without fsync, so that a power cut may break it. A broken one gets the ending ``.broken``, a new
    one takes its place, and the sweep enqueues the jobs again. Other processes notice that the file is another one. A
    file that is neither a queue nor what a power cut leaves of one is not touched.

    Parameters
    ----------
    name
        Name of the queue.
    filename
        The file.
    options
        As of ``SqliteStorage``.

    Raises
    ------
    QueueURLError
        The file is another one than a queue.
    """

    def __init__(self, name: str, filename: str, **options: Any) -> None:
        self._file: tuple[int, int] | None = None
        self._conn: sqlite3.Connection | None = None
        path = Path(filename)
        path.parent.mkdir(parents=True, exist_ok=True)
        with _alone(path):
            if os.path.lexists(path) and not _may_be_queue(path):
                raise QueueURLError(
                    f"the file of the queue cannot be used: {path} is no queue of Spinewatch and is left as it is; set"
                    " SPINEWATCH_QUEUE_URL to a file of its own"
                )
            create_private(path)
            if not _is_whole(path):
                _set_aside(path)
        super().__init__(name, filename=filename, **options)

    def sql(
        self, query: str, params: tuple[Any, ...] | None = None, commit: bool = False, results: bool = False
    ) -> Any:
        """Run one statement; once again when the file was broken.

        Parameters
        ----------
        query
            The statement.
        params
            Its values.
        commit
            Whether it changes something.
        results
            Whether to return rows.

        Returns
        -------
        list of tuple or None
            The rows.
        """
        return self._repeated(lambda: super(QueueFile, self).sql(query, params, commit, results))

    def dequeue(self) -> bytes | None:
        """Take the oldest message; once again when the file was broken.

        Returns
        -------
        bytes or None
            The message, None when there is none.
        """
        message: bytes | None = self._repeated(super().dequeue)
        return message

    @contextmanager
    def db(self, commit: bool = False, close: bool = False) -> Iterator[sqlite3.Cursor]:
        """Open a cursor on the file that has the name now.

        Parameters
        ----------
        commit
            Whether something is changed.
        close
            Whether to close the connection at the end.

        Yields
        ------
        Cursor
            The cursor.
        """
        if self._file is not None and _identity(self.filename) != self._file:
            self._forget()
        with super().db(commit=commit, close=close) as cursor:
            yield cursor

    def _create_connection(self) -> sqlite3.Connection:
        create_private(Path(self.filename))
        self._file = _identity(self.filename)
        connection: sqlite3.Connection = super()._create_connection()
        try:
            if not connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'task'").fetchone():
                for statement in self.ddl:
                    connection.execute(statement)
        except sqlite3.Error:
            connection.close()
            raise
        return connection

    def _repeated(self, action: Callable[[], Answer]) -> Answer:
        try:
            return action()
        except sqlite3.DatabaseError as error:
            if not _means_broken(error):
                raise
            self._renew(error)
        return action()

    def _renew(self, error: sqlite3.DatabaseError) -> None:
        _log.warning("queue_replaced", file=self.filename, error=str(error))
        path = Path(self.filename)
        with _alone(path):
            if _identity(path) == self._file:  # otherwise another process or thread was first
                if not _may_be_queue(path):
                    raise error
                _set_aside(path)
        self._forget()

    def _forget(self) -> None:
        with self.lock:
            connection: sqlite3.Connection | None = self._conn
            self._conn, self._file = None, None
            if connection is not None:
                with suppress(sqlite3.Error):
                    connection.close()


def _may_be_queue(path: Path) -> bool:
    """Return whether a file is a queue or what a power cut may leave of one; it is read as bytes and not touched."""
    if not os.path.isfile(path):
        return not os.path.exists(path)  # a link to nothing
    with path.open("rb") as stream:
        head = stream.read(len(_HEADER))
    if head and not head.strip(b"\0"):
        return _has_pages(path) and _has_no_other_table(path)
    return head in {b"", _HEADER} and _has_no_other_table(path)


def _has_pages(path: Path) -> bool:
    """Return whether a file whose first page is lost has nothing but pages of SQLite."""
    return all(_FIRST_BYTES.issuperset(block[::_PAGE]) for block in _blocks(path))


def _has_no_other_table(path: Path) -> bool:
    """Return whether a file and its write-ahead log define no other tables than those of a queue."""
    log = path.with_name(f"{path.name}-wal")
    names = (name for file in (path, log) if file.is_file() for name in _defined_tables(file))
    return all(name in _TABLES or name.startswith("sqlite_") for name in names)


def _defined_tables(file: Path) -> Iterator[str]:
    """Yield the names of the tables in a file, whose definitions are plain text, also in a damaged one."""
    end = b""
    for block in _blocks(file):
        content = end + block
        for name in _DEFINITION.findall(content):
            yield name.decode(errors="replace").lower()
        end = content[-_LONGEST_DEFINITION:]


def _blocks(file: Path) -> Iterator[bytes]:
    with file.open("rb") as stream:
        while block := stream.read(_BLOCK):
            yield block


def _is_whole(path: Path) -> bool:
    try:
        with closing(sqlite3.connect(path)) as connection:
            (line,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
            return bool(line == "ok")
    except sqlite3.DatabaseError as error:
        return not _means_broken(error)


def _means_broken(error: sqlite3.DatabaseError) -> bool:
    code = getattr(error, "sqlite_errorcode", None)  # absent when the error is the module's own
    return code is not None and code & _PRIMARY_CODE in _BROKEN


def _set_aside(path: Path) -> None:
    for ending in ("-wal", "-shm", ""):
        with suppress(FileNotFoundError):
            os.replace(f"{path}{ending}", f"{path}.broken{ending}")


def _identity(path: str | Path) -> tuple[int, int] | None:
    try:
        found = os.stat(path)
    except FileNotFoundError:
        return None
    return found.st_dev, found.st_ino


@contextmanager
def _alone(path: Path) -> Iterator[None]:
    """Keep other processes from replacing the file."""
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)
