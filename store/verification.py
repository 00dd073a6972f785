"""Verification of a backup: the file, every row and image, its references, its revision and its audit."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from spinewatch.progress import Progress, part, silent
from store.audit import verify_chain_of
from store.digests import differences, has_digests
from store.errors import BackupError
from store.revision import REVISION

_MAX_PROBLEMS = 20
_WITHOUT_IMAGES = 0.5
"""Fraction of the work that is done when the images begin."""

_FORMAT = slice(18, 20)
_WRITE_AHEAD = b"\2\2"
"""What the header of an SQLite file has there once a service used it; a backup has another value."""


@dataclass(frozen=True)
class Verification:
    """What is in a backup.

    Attributes
    ----------
    revision
        Revision of its tables.
    surgeries
        Number of surgeries.
    stages
        Number of stages.
    images
        Number of images.
    image_bytes
        Their size together, bytes.
    problems
        What is wrong with it, one sentence each, twenty at most; a backup without any can be restored.
    has_digests
        Whether it has digests of its rows, so that their contents were checked. A backup of an earlier version and the
        database of a service have none.
    """

    revision: str
    surgeries: int
    stages: int
    images: int
    image_bytes: int
    problems: tuple[str, ...]
    has_digests: bool


def verify(copy: Path, progress: Progress = silent) -> Verification:
    """Read every byte of a backup and check it.

    Parameters
    ----------
    copy
        The backup.
    progress
        Progress of the checks.

    Returns
    -------
    Verification
        What it contains, and its problems.

    Raises
    ------
    BackupError
        It cannot be read, or is not a copy of a database of Spinewatch.
    """
    if not os.path.isfile(copy):
        raise BackupError(f"there is no file {copy}; name a backup")
    wal = copy.with_name(f"{copy.name}-wal")
    if os.path.exists(wal) and wal.stat().st_size:
        raise BackupError(
            f"{wal} belongs to {copy}, which a process uses or a plain copy tore from it; make a backup of the database"
            " with: spinewatch backup"
        )
    try:
        # immutable: nothing is locked or written, so that a copy on a read-only disk can be verified
        with closing(sqlite3.connect(f"{copy.resolve().as_uri()}?immutable=1", uri=True)) as connection:
            connection.text_factory = lambda text: text.decode(errors="replace")
            return _verify(connection, copy, progress)
    # a damaged row has values of any type, and a damaged name is no UTF-8
    except (sqlite3.Error, UnicodeError, TypeError) as error:
        raise BackupError(
            f"{copy} is not a whole copy of a database: {_one_line(error)}; choose another backup"
        ) from error
    except OSError as error:
        raise BackupError(f"cannot read {copy}: {error.strerror}; choose another backup") from error


def _verify(connection: sqlite3.Connection, copy: Path, progress: Progress) -> Verification:
    progress("file", 0.0)
    revision = _revision(connection)
    problems = [*_size_problems(connection, copy), *_file_problems(connection)]
    progress("references", _WITHOUT_IMAGES / 2)
    problems += _reference_problems(connection)
    carries_digests = has_digests(connection) and not _was_used(copy)
    if carries_digests:
        problems += differences(connection, part(progress, _WITHOUT_IMAGES * 0.6, _WITHOUT_IMAGES))
    surgeries, stages = (_count(connection, table) for table in ("surgeries", "stages"))
    number, size = 0, 0
    total = max(_count(connection, "images"), 1)
    rows = connection.execute("SELECT sha256, CAST(content AS BLOB), size_bytes FROM images")
    for digest, content, stated in rows:
        progress("images", _WITHOUT_IMAGES + (1 - _WITHOUT_IMAGES) * number / total)
        number, size = number + 1, size + len(content)
        if sha256(content).hexdigest() != digest or len(content) != stated:
            problems.append(f"image {str(digest)[:12]} differs from its SHA-256 or its size")
    if _has_chain(connection):
        progress("audit", 1.0)
        chain = verify_chain_of(connection)
        if not chain.is_whole:
            problems.append(f"the audit is broken: {chain.reason}")
    if revision > REVISION:
        problems.append(f"its tables are at revision {revision}, which needs a newer version of Spinewatch")
    return Verification(
        revision, surgeries, stages, number, size, tuple(problems[:_MAX_PROBLEMS]), carries_digests
    )


def _revision(connection: sqlite3.Connection) -> str:
    try:
        (revision,) = connection.execute("SELECT version_num FROM alembic_version").fetchone() or ("",)
    except sqlite3.OperationalError as error:
        if "no such table" not in str(error):
            raise
        revision = ""
    if not revision:
        raise BackupError("the file has no tables of Spinewatch; choose another backup")
    return str(revision)


def _was_used(copy: Path) -> bool:
    """Return whether a service used the file: the digests of a backup put in place by hand are out of date then."""
    with copy.open("rb") as stream:
        return stream.read(_FORMAT.stop)[_FORMAT] == _WRITE_AHEAD


def _size_problems(connection: sqlite3.Connection, copy: Path) -> Iterator[str]:
    (pages,), (page_size,) = (
        connection.execute(f"PRAGMA {name}").fetchone() for name in ("page_count", "page_size")
    )
    size = copy.stat().st_size
    if size != pages * page_size:
        yield f"the file has {size} bytes instead of {pages * page_size}"


def _file_problems(connection: sqlite3.Connection) -> Iterator[str]:
    for (line,) in connection.execute(f"PRAGMA integrity_check({_MAX_PROBLEMS})"):
        if line != "ok":
            yield f"the file is damaged: {_one_line(line)}"


def _reference_problems(connection: sqlite3.Connection) -> Iterator[str]:
    for table, row, parent, _ in connection.execute("PRAGMA foreign_key_check"):
        yield f"row {row} of {table} refers to a row of {parent} that is not there"


def _has_chain(connection: sqlite3.Connection) -> bool:
    """Return whether events are chained, which those of earlier versions are not."""
    return any(column == "hash" for _, column, *_ in connection.execute("PRAGMA table_info(events)"))


def _count(connection: sqlite3.Connection, table: str) -> int:
    (count,) = connection.execute(f"SELECT count(*) FROM {table}").fetchone()  # noqa: S608 - our own names
    return int(count)


def _one_line(message: object) -> str:
    return " ".join(str(message).split())
