"""Verification of a backup: the file, its references, every image, its revision and its audit, without changing it."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from spinewatch.progress import Progress, silent
from store.audit import verify_chain_of
from store.errors import BackupError
from store.revision import REVISION

_MAX_PROBLEMS = 20
_WITHOUT_IMAGES = 0.5
"""Fraction of the work that is done when the images begin."""


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
    """

    revision: str
    surgeries: int
    stages: int
    images: int
    image_bytes: int
    problems: tuple[str, ...]


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
    if not copy.is_file():
        raise BackupError(f"there is no file {copy}; name a backup")
    wal = copy.with_name(f"{copy.name}-wal")
    if wal.exists() and wal.stat().st_size:
        raise BackupError(
            f"{wal} belongs to {copy}, which a process uses or a plain copy tore from it; make a backup of the database"
            " with: spinewatch backup"
        )
    try:
        # immutable: nothing is locked or written, so that a copy on a read-only disk can be verified
        with closing(sqlite3.connect(f"{copy.resolve().as_uri()}?immutable=1", uri=True)) as connection:
            return _verify(connection, progress)
    except sqlite3.Error as error:
        raise BackupError(
            f"{copy} is not a whole copy of a database: {error}; choose another backup"
        ) from error


def _verify(connection: sqlite3.Connection, progress: Progress) -> Verification:
    progress("file", 0.0)
    revision = _revision(connection)
    problems = [*_file_problems(connection)]
    progress("references", _WITHOUT_IMAGES / 2)
    problems += _reference_problems(connection)
    surgeries, stages = (_count(connection, table) for table in ("surgeries", "stages"))
    number, size = 0, 0
    total = max(_count(connection, "images"), 1)
    rows = connection.execute("SELECT sha256, CAST(content AS BLOB), size_bytes FROM images")
    for digest, content, stated in rows:
        progress("images", _WITHOUT_IMAGES + (1 - _WITHOUT_IMAGES) * number / total)
        number, size = number + 1, size + len(content)
        if sha256(content).hexdigest() != digest or len(content) != stated:
            problems.append(f"image {digest[:12]} differs from its SHA-256 or its size")
    if _has_chain(connection):
        progress("audit", 1.0)
        chain = verify_chain_of(connection)
        if not chain.is_whole:
            problems.append(f"the audit is broken: {chain.reason}")
    if revision > REVISION:
        problems.append(f"its tables are at revision {revision}, which needs a newer version of Spinewatch")
    return Verification(revision, surgeries, stages, number, size, tuple(problems[:_MAX_PROBLEMS]))


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


def _file_problems(connection: sqlite3.Connection) -> Iterator[str]:
    for (line,) in connection.execute(f"PRAGMA integrity_check({_MAX_PROBLEMS})"):
        if line != "ok":
            yield f"the file is damaged: {' '.join(str(line).split())}"


def _reference_problems(connection: sqlite3.Connection) -> Iterator[str]:
    for table, row, parent, _ in connection.execute("PRAGMA foreign_key_check"):
        yield f"row {row} of {table} refers to a row of {parent} that is not there"


def _has_chain(connection: sqlite3.Connection) -> bool:
    """Return whether events are chained, which those of earlier versions are not."""
    return any(column == "hash" for _, column, *_ in connection.execute("PRAGMA table_info(events)"))


def _count(connection: sqlite3.Connection, table: str) -> int:
    (count,) = connection.execute(f"SELECT count(*) FROM {table}").fetchone()  # noqa: S608 - our own names
    return int(count)
