"""Revocations are carried to another database, and sessions ended."""

import sqlite3

from store.restored_access import limit_access, revocations


def database(*keys: tuple[str, str, str | None]) -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    connection.execute("CREATE TABLE api_keys (prefix, key_sha256, revoked_at)")
    connection.execute("CREATE TABLE api_sessions (token_sha256)")
    connection.execute("INSERT INTO api_sessions VALUES ('x')")
    connection.executemany("INSERT INTO api_keys VALUES (?, ?, ?)", keys)
    return connection


def test_keys_are_revoked_as_before_and_sessions_ended() -> None:
    revoked = revocations(
        database(("a", "1", "then"), ("b", "2", None), ("c", "3", "then"), ("d", "4", "then"))
    )
    assert revoked == [("then", "a", "1"), ("then", "c", "3"), ("then", "d", "4")]
    restored = database(("a", "1", None), ("b", "2", None), ("c", "other", None), ("d", "4", "earlier"))
    assert limit_access(restored, revoked) == ["a"]
    rows = restored.execute("SELECT prefix, revoked_at FROM api_keys ORDER BY prefix").fetchall()
    assert rows == [("a", "then"), ("b", None), ("c", None), ("d", "earlier")]
    assert restored.execute("SELECT * FROM api_sessions").fetchall() == []


def test_a_database_without_keys_is_left_alone() -> None:
    empty = sqlite3.connect(":memory:")
    assert revocations(empty) is None
    assert limit_access(empty, [("then", "a", "1")]) == []
