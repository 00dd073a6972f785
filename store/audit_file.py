"""The chain of events in a file, checked offline: a database, a backup, or a copy as JSON lines."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from contract.audit import AuditEvent
from store.audit import Chain, check_chain, verify_chain_of
from store.errors import AuditFileError
from store.regular_file import open_regular

_SQLITE = b"SQLite format 3\0"
_EXPECTED = re.compile(r"([0-9]{1,18}):([0-9a-f]{64})", re.ASCII | re.IGNORECASE)
"""A number that SQLite can hold, and a SHA-256."""

_MAX_LINE_BYTES = 1024 * 1024


def verify_file(file: Path, expected: str | None = None) -> Chain:
    """Check the chain of events in a file.

    Parameters
    ----------
    file
        A database of Spinewatch (SQLite), a backup of one, or a copy of all its events as JSON lines.
    expected
        Number and hash of an earlier last event, ``NUMBER:HASH``, which must still be there; None to expect nothing.

    Returns
    -------
    Chain
        Whole, or broken at an event.

    Raises
    ------
    AuditFileError
        The file cannot be read or has no events, or ``expected`` is no number and hash.
    """
    kept = None if expected is None else _kept(expected)
    try:
        with open_regular(file) as stream:
            is_database = stream.read(len(_SQLITE)) == _SQLITE
        chain = _of_database(file) if is_database else check_chain(_lines(file))
        if not is_database and chain.is_whole and not chain.events:
            raise AuditFileError(
                f"{file} is empty and no copy of an audit; name a database, a backup, or a copy as JSON lines"
            )
        if kept is not None and chain.is_whole and not _has(file, is_database, *kept):
            number = kept[0]
            reason = f"event {number} has another hash than the one expected, or is missing"
            return Chain(chain.events, chain.last, chain.head, number, reason)
    except OSError as error:
        raise AuditFileError(f"cannot read {file}: {error.strerror}") from error
    except (sqlite3.Error, LookupError, TypeError, ValueError) as error:  # tables and values of any kind
        raise AuditFileError(
            f"{file} has no events that can be read: {error}; name a database or a backup"
        ) from error
    return chain


def _kept(expected: str) -> tuple[int, str]:
    match = _EXPECTED.fullmatch(expected)
    if match is None:
        raise AuditFileError(
            "what is expected is not NUMBER:HASH; take it from an earlier output of this command"
        )
    return int(match[1]), match[2].lower()


def _of_database(file: Path) -> Chain:
    with closing(_connect(file)) as connection:
        return verify_chain_of(connection)


def _has(file: Path, is_database: bool, number: int, digest: str) -> bool:
    if not is_database:
        return any(row["seq"] == number and row["hash"] == digest for row in _lines(file))
    with closing(_connect(file)) as connection:
        found = connection.execute("SELECT hash FROM events WHERE seq = ?", (number,)).fetchone()
        return found is not None and found[0] == digest


def _connect(file: Path) -> sqlite3.Connection:
    """Open a file to read; one that no process has open is not touched at all."""
    log = file.with_name(f"{file.name}-wal")
    how = "mode=ro" if log.exists() else "immutable=1"
    return sqlite3.connect(f"{file.resolve().as_uri()}?{how}", uri=True)


def _lines(file: Path) -> Iterator[dict[str, Any]]:
    with open_regular(file) as stream:
        lines = iter(lambda: stream.readline(_MAX_LINE_BYTES + 1), b"")
        for number, line in enumerate(lines, start=1):
            if len(line) > _MAX_LINE_BYTES:
                raise AuditFileError(f"line {number} of {file} is longer than that of any event")
            try:
                document = json.loads(line.decode("utf-8", errors="replace"))
                event = AuditEvent.model_validate_json(json.dumps(document))
            except (ValueError, ValidationError, RecursionError) as error:
                raise AuditFileError(
                    f"line {number} of {file} is no event; name a database, a backup, or a copy as JSON lines"
                ) from error
            yield {
                **event.model_dump(),
                "actor_kind": event.actor_kind.value,
                "outcome": event.outcome.value,
            }
