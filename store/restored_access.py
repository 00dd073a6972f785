"""Access after a restore: a backup must not let in whom the database that it replaces kept out."""

from __future__ import annotations

import sqlite3

_REVOKED = "SELECT revoked_at, prefix, key_sha256 FROM api_keys WHERE revoked_at IS NOT NULL ORDER BY prefix"
_REVOKE = "UPDATE api_keys SET revoked_at = ? WHERE prefix = ? AND key_sha256 = ? AND revoked_at IS NULL"

Revocation = tuple[str, str, str]
"""Time, visible part of the key and SHA-256 of the key, as the database has them."""


def revocations(replaced: sqlite3.Connection) -> list[Revocation] | None:
    """Return the revoked keys of a database.

    Parameters
    ----------
    replaced
        Connection to the database.

    Returns
    -------
    list of Revocation or None
        The keys; None if they cannot be read.
    """
    try:
        return replaced.execute(_REVOKED).fetchall()
    except sqlite3.DatabaseError:
        return None


def limit_access(restored: sqlite3.Connection, revoked: list[Revocation]) -> list[str]:
    """End all sessions of a database, and revoke keys.

    Parameters
    ----------
    restored
        Connection to the database.
    revoked
        Keys that are revoked.

    Returns
    -------
    list of str
        Visible parts of the keys that were valid.
    """
    tables = {name for (name,) in restored.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    # A DELETE changes the file even where there is nothing to delete.
    if "api_sessions" in tables and restored.execute("SELECT 1 FROM api_sessions LIMIT 1").fetchone():
        restored.execute("DELETE FROM api_sessions")
    if "api_keys" not in tables:
        return []
    return [key[1] for key in revoked if restored.execute(_REVOKE, key).rowcount]
