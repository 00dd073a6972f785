"""Whether an event was committed to the database since the last question, at next to no cost."""

from __future__ import annotations

import sqlite3
from pathlib import Path


class Commits:
    """Tells whether an event was committed: first by the number that SQLite keeps of commits, then by the last event.

    Each job commits its progress and signs of life many times, and nobody waits for those.

    Parameters
    ----------
    path
        File of an SQLite database; None for a database that does not tell.

    References
    ----------
    SQLite, PRAGMA data_version: it differs after a commit by any other connection.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._connection: sqlite3.Connection | None = None
        self._version: int | None = None
        self._last: int | None = None

    @property
    def are_seen(self) -> bool:
        """Whether the database tells; otherwise ``happened`` is always true."""
        return self._path is not None

    def happened(self) -> bool:
        """Return whether an event was committed since the last question; true when it cannot be known.

        Returns
        -------
        bool
            True at the first question too.
        """
        if self._path is None:
            return True
        try:
            version = self._read(self._path, "PRAGMA data_version")
            if version == self._version:
                return False
            before, self._version = self._last, version
            self._last = self._read(self._path, "SELECT coalesce(max(seq), 0) FROM events")
        except sqlite3.Error:  # held, replaced or away: whoever looks then meets the error itself
            self.close()
            return True
        return self._last != before

    def close(self) -> None:
        """Close the connection; the next question opens another."""
        if self._connection is not None:
            self._connection.close()
        self._connection = self._version = self._last = None

    def _read(self, path: Path, query: str) -> int:
        if self._connection is None:
            uri = f"{path.resolve().as_uri()}?mode=ro"
            self._connection = sqlite3.connect(uri, uri=True, timeout=0, check_same_thread=False)
        (number,) = self._connection.execute(query).fetchone()
        return int(number)
