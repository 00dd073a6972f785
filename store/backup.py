"""Backups of an SQLite database: one file, consistent while others write, whole or not there at all."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from spinewatch.progress import Progress, part, silent
from store.database import sqlite_path
from store.digests import TABLE, has_digests, write_digests
from store.errors import BackupError
from store.partial_file import partial_file
from store.restored_access import limit_access, revocations

_STEPS_PER_REPORT = 500
"""Steps of SQLite's virtual machine between two reports; an image takes some dozens."""

_COMPANIONS = ("-wal", "-shm", "-journal")
"""Endings of the files that belong to a database's file."""

_COPY_BYTES = 1 << 20

_COPIED = 0.9
"""Fraction of the work that is done when the digests begin."""


@dataclass(frozen=True)
class Restored:
    """What became of a database that was replaced.

    Attributes
    ----------
    kept
        The file that has the old database, None when there was none.
    revoked
        Visible parts of the keys that are valid in the backup and were revoked as in the old database.
    knows_revocations
        Whether the old database could be asked.
    """

    kept: Path | None
    revoked: tuple[str, ...]
    knows_revocations: bool


def back_up(url: str, target: Path, progress: Progress = silent) -> int:
    """Copy a database to a new file of mode 0600, while the service runs.

    The copy is written under a temporary name, gets the digests of everything in it (`store.digests`), is synced to the
    disk and then given its name.

    Parameters
    ----------
    url
        SQLAlchemy URL of the database.
    target
        The new file.
    progress
        Progress of the copy.

    Returns
    -------
    int
        Size of the copy, bytes.

    Raises
    ------
    BackupError
        The database is not an SQLite file or cannot be read, or the file exists or cannot be written.

    References
    ----------
    https://www.sqlite.org/lang_vacuum.html: VACUUM INTO reads one state of the database and does not sync its output.
    """
    source = database_file(url)
    if not os.path.isfile(source):
        raise BackupError(f"there is no database at {source}; set SPINEWATCH_DATABASE_URL")
    require_new(target)
    with _new_file(target) as temporary:
        try:
            with closing(_connect(source)) as connection:
                report = _reporter(connection, temporary, part(progress, 0.0, _COPIED))
                connection.set_progress_handler(report, _STEPS_PER_REPORT)
                connection.execute("VACUUM INTO ?", (str(temporary),))
            _add_digests(temporary, part(progress, _COPIED, 1.0))
        except sqlite3.Error as error:
            raise BackupError(
                f"the database {source} cannot be copied to {target}: {error}; check both files and the free space"
            ) from error
        return temporary.stat().st_size


def restore(url: str, copy: Path, now: datetime, *, replace: bool, progress: Progress = silent) -> Restored:
    """Put a copy of a database in its place, without its digests; the database that was there is kept beside it.

    All sessions are ended, and keys that the database there had revoked are revoked in the copy.

    Parameters
    ----------
    url
        SQLAlchemy URL of the database.
    copy
        The backup, which was verified (`store.verification`).
    now
        Time, which names the file that the old database is kept in.
    replace
        Whether a database that exists may be replaced.
    progress
        Progress of the copy.

    Returns
    -------
    Restored
        The file that has the old database, and the keys that were revoked.

    Raises
    ------
    BackupError
        A database exists and may not be replaced, a service uses it, or a file cannot be read or written.
    """
    target = database_file(url)
    exists = os.path.exists(target)
    if exists and not replace:
        raise BackupError(f"there is a database at {target}; give --replace to keep it under another name")
    kept = _kept_name(target, now) if exists else None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with partial_file(target, _COMPANIONS) as (temporary, _):
            _copy(copy, temporary, progress)
            _drop_digests(temporary, copy)
            with _unused(target) as replaced:
                revoked = None if replaced is None else revocations(replaced)
                with closing(_connect(temporary)) as connection:
                    again = limit_access(connection, revoked or [])
                _sync(temporary)
                _move_aside(target, kept)
                os.replace(temporary, target)
                _sync(target.parent)
    except OSError as error:
        raise BackupError(f"cannot restore to {target}: {error.strerror}: {error.filename}") from error
    return Restored(kept, tuple(again), knows_revocations=revoked is not None)


def database_file(url: str) -> Path:
    """Return the file of a database that can be backed up by copying a file.

    Parameters
    ----------
    url
        SQLAlchemy URL of the database.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    BackupError
        The database is on a server.
    """
    path = sqlite_path(url)
    if path is None:
        raise BackupError(
            "the database is on a server; back it up with pg_dump --format=custom and restore it with pg_restore"
        )
    return path


def require_new(target: Path) -> None:
    """Check that a file can be made.

    Parameters
    ----------
    target
        The file.

    Raises
    ------
    BackupError
        It exists, its folder does not, or its name is not UTF-8.
    """
    try:
        str(target).encode()
    except UnicodeEncodeError:
        raise BackupError(f"the name {str(target)!a} is not UTF-8; choose another name") from None
    if os.path.lexists(target):
        raise BackupError(f"{target} exists; choose another name")
    if not os.path.isdir(target.parent):
        raise BackupError(f"there is no folder {target.parent}; create it or choose another")


@contextmanager
def _new_file(target: Path) -> Iterator[Path]:
    """Give a temporary file beside a target, which gets the target's name at the end."""
    try:
        with partial_file(target, _COMPANIONS) as (temporary, _):
            yield temporary
            _sync(temporary)
            _give_name(temporary, target)
            _sync(target.parent)
    except OSError as error:
        raise BackupError(f"cannot write {target}: {error.strerror}") from error


def _add_digests(temporary: Path, progress: Progress) -> None:
    with closing(_connect(temporary)) as connection:
        for setting in ("journal_mode=OFF", "synchronous=OFF"):  # after a failure, the file is removed
            connection.execute(f"PRAGMA {setting}")
        connection.execute("BEGIN")
        write_digests(connection, progress)
        connection.execute("COMMIT")


def _drop_digests(temporary: Path, copy: Path) -> None:
    try:
        with closing(_connect(temporary)) as connection:
            if has_digests(connection):
                connection.execute(f"DROP TABLE {TABLE}")
    except sqlite3.Error as error:
        raise BackupError(
            f"{copy} is not a whole copy of a database: {error}; choose another backup"
        ) from error
    _sync(temporary)


def _give_name(temporary: Path, target: Path) -> None:
    """Rename a file and never overwrite another one."""
    try:
        os.link(temporary, target)
    except FileExistsError:
        raise BackupError(f"{target} exists; choose another name") from None
    except OSError:  # a file system without links, such as that of most USB sticks
        require_new(target)
        os.rename(temporary, target)


def _connect(source: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{source.resolve().as_uri()}?mode=rw", uri=True, isolation_level=None, timeout=10)


def _reporter(connection: sqlite3.Connection, copy: Path, progress: Progress) -> Callable[[], int]:
    (pages,), (page_size,), (free,) = (
        connection.execute(f"PRAGMA {name}").fetchone()
        for name in ("page_count", "page_size", "freelist_count")
    )
    total = max((pages - free) * page_size, 1)

    def report() -> int:
        progress("copy", min(copy.stat().st_size / total, 1.0))
        return 0

    return report


@contextmanager
def _unused(target: Path) -> Iterator[sqlite3.Connection | None]:
    """Hold a database that no process has open, with everything in its one file."""
    if not os.path.isfile(target):
        yield None
        return
    connection = sqlite3.connect(target, isolation_level=None, timeout=0)
    with closing(connection):
        try:
            # SQLite leaves the WAL mode only when no other connection is open, and writes the -wal back then
            connection.execute("PRAGMA journal_mode=DELETE")
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as error:
            raise BackupError(
                f"a process uses {target} ({error}); stop the service and its workers, then restore"
            ) from error
        except sqlite3.DatabaseError:  # it is broken, so that nothing can use it
            connection.close()
            yield None
            return
        yield connection


def _move_aside(target: Path, kept: Path | None) -> None:
    if kept is None:
        return
    for ending in ("", *_COMPANIONS):
        part = target.with_name(target.name + ending)
        if part.exists():
            os.rename(part, kept.with_name(kept.name + ending))


def _kept_name(target: Path, now: datetime) -> Path:
    stem = f"{target.stem}-replaced-{now:%Y%m%dT%H%M%SZ}"
    names = (f"{stem}{f'-{n}' if n else ''}{target.suffix}" for n in range(1000))
    return next(path for name in names if not (path := target.with_name(name)).exists())


def _copy(source: Path, target: Path, progress: Progress) -> None:
    total = max(source.stat().st_size, 1)
    with source.open("rb") as reader, target.open("wb") as writer:
        while block := reader.read(_COPY_BYTES):
            writer.write(block)
            progress("copy", min(writer.tell() / total, 1.0))
    _sync(target)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
