"""Digests of the rows of an SQLite file, which a backup carries in a table of its own."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256

from spinewatch.progress import Progress, silent

TABLE = "backup_digests"
"""The table that has the digests, which only backups have."""

_CREATE = f"CREATE TABLE {TABLE} (name TEXT NOT NULL, row_count INTEGER NOT NULL, sha256 TEXT NOT NULL)"
_SCHEMA = "sqlite_master"
_ALL_DEFINITIONS = "SELECT type, name, tbl_name, sql FROM sqlite_master"
_DEFINITIONS = f"{_ALL_DEFINITIONS} WHERE tbl_name != '{TABLE}' ORDER BY type, name"
_IMAGES = "images"


@dataclass(frozen=True)
class TableDigest:
    """What the rows of a table are known by.

    Attributes
    ----------
    rows
        Their number.
    sha256
        SHA-256 of all of them, hexadecimal.
    """

    rows: int
    sha256: str


def digests_of(connection: sqlite3.Connection, progress: Progress = silent) -> dict[str, TableDigest]:
    """Compute the digests of all tables, and of the definitions of tables, indexes and triggers.

    The content of an image is left out: its own SHA-256, which is a column of its row, covers it.

    Parameters
    ----------
    connection
        Connection that reads.
    progress
        Progress of the work.

    Returns
    -------
    dict of str to TableDigest
        The digests by the name of the table.
    """
    names = _tables(connection)
    found = {}
    for number, name in enumerate(names):
        progress("digests", number / len(names))
        query = _query(connection, name)
        with _bytes_for_text(connection):
            found[name] = _digest(connection.execute(query))
    return found


def write_digests(connection: sqlite3.Connection, progress: Progress = silent) -> None:
    """Add the digests of everything in a file to it; those that it had are replaced.

    Parameters
    ----------
    connection
        Connection that writes, in its own transaction.
    progress
        Progress of the work.
    """
    connection.execute(f"DROP TABLE IF EXISTS {TABLE}")
    found = digests_of(connection, progress)
    connection.execute(_CREATE)
    connection.executemany(
        f"INSERT INTO {TABLE} VALUES (?, ?, ?)",  # noqa: S608 - our own name
        [(name, digest.rows, digest.sha256) for name, digest in found.items()],
    )


def has_digests(connection: sqlite3.Connection) -> bool:
    """Return whether a file has digests; one whose table has another name because of damage has them, too.

    Parameters
    ----------
    connection
        Connection that reads.

    Returns
    -------
    bool
        Whether any definition of a table has the name of theirs.
    """
    query = "SELECT count(*) FROM sqlite_master WHERE ?1 IN (name, tbl_name) OR instr(sql, ?1)"
    (count,) = connection.execute(query, (TABLE,)).fetchone()
    return bool(count)


def differences(connection: sqlite3.Connection, progress: Progress = silent) -> Iterator[str]:
    """Compare the rows of a file with the digests that it has.

    Parameters
    ----------
    connection
        Connection that reads.
    progress
        Progress of the work.

    Yields
    ------
    str
        What differs, a sentence for each table.
    """
    own = ("table", TABLE, TABLE, _CREATE)
    if connection.execute(f"{_ALL_DEFINITIONS} WHERE name = ?", (TABLE,)).fetchall() != [own]:
        yield f"the definition of table {TABLE} is damaged"
    rows = connection.execute(f"SELECT name, row_count, sha256 FROM {TABLE}")  # noqa: S608 - our own name
    stated = {name: TableDigest(count, digest) for name, count, digest in rows}
    found = digests_of(connection, progress)
    for name in sorted({*stated, *found}, key=str):
        if name not in found:
            yield f"table {name} is missing"
        elif name not in stated:
            yield f"table {name} has no digest"
        elif found[name].rows != stated[name].rows:
            yield f"table {name} has {found[name].rows} rows instead of {stated[name].rows}"
        elif found[name] != stated[name]:
            yield f"table {name} differs from its SHA-256"


def _tables(connection: sqlite3.Connection) -> list[str]:
    query = "SELECT name FROM sqlite_master WHERE type = 'table' AND name != ? ORDER BY name"
    return [_SCHEMA, *(name for (name,) in connection.execute(query, (TABLE,)))]


def _query(connection: sqlite3.Connection, table: str) -> str:
    """Return the query for all rows of a table in the order of its primary key."""
    if table == _SCHEMA:  # where a table begins is no content
        return _DEFINITIONS
    columns = connection.execute(f"PRAGMA table_info({_quoted(table)})").fetchall()
    names = ", ".join(_value(table, name) for _, name, *_ in columns)
    key = sorted((place, name) for _, name, _, _, _, place in columns if place)
    order = ", ".join(_quoted(name) for _, name in key) or "rowid"
    return f"SELECT {names} FROM {_quoted(table)} ORDER BY {order}"  # noqa: S608 - names are quoted


def _value(table: str, column: str) -> str:
    return "typeof(content)" if (table, column) == (_IMAGES, "content") else _quoted(column)


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


@contextmanager
def _bytes_for_text(connection: sqlite3.Connection) -> Iterator[None]:
    """Read texts as ``bytearray``, which differs from the ``bytes`` of a blob and need not be UTF-8."""
    factory = connection.text_factory
    connection.text_factory = bytearray
    try:
        yield
    finally:
        connection.text_factory = factory


def _digest(rows: Iterable[tuple[object, ...]]) -> TableDigest:
    count, digest = 0, sha256()
    for row in rows:
        count += 1
        for value in row:
            digest.update(_encoded(value))
    return TableDigest(count, digest.hexdigest())


def _encoded(value: object) -> bytes:
    """Return the bytes of a value, which begin with its type and length, so that no two rows have the same."""
    if value is None:
        return b"n"
    if isinstance(value, int):
        return b"i%d;" % value
    if isinstance(value, float):
        return b"f" + struct.pack(">d", value)
    if isinstance(value, bytearray):
        return b"t%d:" % len(value) + value
    if isinstance(value, bytes):
        return b"b%d:" % len(value) + value
    raise TypeError(f"SQLite has no values of {type(value)}")
