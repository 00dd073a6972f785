"""The chain of events in a file, checked offline: a database, a backup, or a copy as JSON lines."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from contract.audit import AuditEvent
from store.audit import Chain, check_chain, verify_chain_of
from store.errors import AuditFileError
from store.events import FIRST_HASH

_SQLITE = b"SQLite format 3\0"


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
        with file.open("rb") as stream:
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
    except sqlite3.Error as error:
        raise AuditFileError(
            f"{file} has no events that can be read: {error}; name a database or a backup"
        ) from error
    return chain


def _kept(expected: str) -> tuple[int, str]:
    number, _, digest = expected.partition(":")
    if not (number.isascii() and number.isdigit() and len(digest) == len(FIRST_HASH)):
        raise AuditFileError(
            "what is expected is not NUMBER:HASH; take it from an earlier output of this command"
        )
    return int(number), digest.lower()


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
    with file.open(encoding="utf-8", errors="replace") as stream:
        for number, line in enumerate(stream, start=1):
            try:
                event = AuditEvent.model_validate_json(json.dumps(json.loads(line)))
            except (ValueError, ValidationError, RecursionError) as error:
                raise AuditFileError(
                    f"line {number} of {file} is no event; name a database, a backup, or a copy as JSON lines"
                ) from error
            yield {
                **event.model_dump(),
                "actor_kind": event.actor_kind.value,
                "outcome": event.outcome.value,
            }
