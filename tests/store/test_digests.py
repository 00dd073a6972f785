import sqlite3
from collections.abc import Iterator
from contextlib import closing

import pytest

from store.digests import differences, digests_of, has_digests, write_digests


@pytest.fixture
def connection() -> Iterator[sqlite3.Connection]:
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        yield connection


def digest_of(*values: str) -> str:
    """Return the digest of a table with one row of these values, which are written as in SQL."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.execute("CREATE TABLE t (a, b)")
        connection.execute(f"INSERT INTO t VALUES ({', '.join(values)})")  # noqa: S608
        return digests_of(connection)["t"].sha256


def test_values_that_differ_in_anything_have_other_digests() -> None:
    rows = [
        *[("NULL", "NULL"), ("''", "NULL"), ("NULL", "''"), ("x''", "NULL"), ("0", "NULL"), ("0.0", "NULL")],
        *[("'1'", "NULL"), ("1", "NULL"), ("1.0", "NULL"), ("x'31'", "NULL"), ("-1", "NULL"), ("'n'", "NULL")],
        *[("'ab'", "'c'"), ("'a'", "'bc'"), ("'a' || char(0)", "'bc'"), ("'a'", "x'6263'"), ("11", "1"), ("1", "11")],
        *[("0.1", "1"), ("0.1 + 2e-17", "1"), ("9223372036854775807", "1")],
        *[("CAST(x'ff' AS TEXT)", "1"), ("CAST(x'fe' AS TEXT)", "1")],
    ]  # fmt: skip
    assert len({digest_of(*row) for row in rows}) == len(rows)


def test_the_order_is_that_of_the_primary_key(connection: sqlite3.Connection) -> None:
    key = "(name TEXT, n INTEGER, PRIMARY KEY (n, name))"
    for table, rows in (("one", "('a', 1), ('b', 1), ('a', 2)"), ("other", "('a', 2), ('b', 1), ('a', 1)")):
        connection.execute(f"CREATE TABLE {table} {key}")
        connection.execute(f"INSERT INTO {table} VALUES {rows}")  # noqa: S608
    found = digests_of(connection)
    assert found["one"] == found["other"]
    assert found["one"].rows == 3


def test_any_name_and_a_table_without_rowid_are_digested(connection: sqlite3.Connection) -> None:
    connection.execute('CREATE TABLE "a ""name" ("its ""key" TEXT PRIMARY KEY, "select") WITHOUT ROWID')
    connection.execute("""INSERT INTO "a ""name" VALUES ('x', 1)""")
    assert digests_of(connection)['a "name'].rows == 1


def test_digests_that_are_written_are_found_again(connection: sqlite3.Connection) -> None:
    connection.execute("CREATE TABLE t (a)")
    assert not has_digests(connection)
    for _ in range(2):
        connection.execute("INSERT INTO t VALUES (1)")
        write_digests(connection)
        assert has_digests(connection)
        assert list(differences(connection)) == []


@pytest.mark.parametrize(
    ("statement", "difference"),
    [
        ("UPDATE t SET a = 2", "table t differs from its SHA-256"),
        ("DELETE FROM t", "table t has 0 rows instead of 1"),
        ("DROP TABLE t", "table t is missing"),
        ("CREATE TABLE u (a)", "table u has no digest"),
        ("CREATE TRIGGER r AFTER INSERT ON t BEGIN SELECT 1; END", "table sqlite_master has"),
        ("ALTER TABLE backup_digests ADD COLUMN x", "the definition of table backup_digests is damaged"),
    ],
)
def test_what_differs_is_named(connection: sqlite3.Connection, statement: str, difference: str) -> None:
    connection.execute("CREATE TABLE t (a)")
    connection.execute("INSERT INTO t VALUES (1)")
    write_digests(connection)
    connection.execute(statement)
    assert any(line.startswith(difference) for line in differences(connection))
