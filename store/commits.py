"""Whether anything was committed to the database since the last question, at next to no cost."""

from __future__ import annotations

import sqlite3
from pathlib import Path


class Commits:
    """Tells whether anything was committed, by the number that SQLite keeps of it.

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

    @property
    def are_seen(self) -> bool:
        """Whether the database tells; otherwise ``happened`` is always true."""
        return self._path is not None

    def happened(self) -> bool:
        """Return whether anything was committed since the last question; true when it cannot be known.

        Returns
        -------
        bool
            True at the first question too.
        """
        if self._path is None:
            return True
        before = self._version
        try:
            self._version = self._read(self._path)
        except sqlite3.Error:  # held, replaced or away: whoever looks then meets the error itself
            self.close()
            return True
        return self._version != before

    def close(self) -> None:
        """Close the connection; the next question opens another."""
        if self._connection is not None:
            self._connection.close()
        self._connection = self._version = None

    def _read(self, path: Path) -> int:
        if self._connection is None:
            uri = f"{path.resolve().as_uri()}?mode=ro"
            self._connection = sqlite3.connect(uri, uri=True, timeout=0, check_same_thread=False)
        (version,) = self._connection.execute("PRAGMA data_version").fetchone()
        return int(version)
