import json
import os
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from store import audit, events
from store.audit_file import verify_file
from store.backup import back_up
from store.database import Database
from store.errors import AuditFileError
from tests.backends import about_the_sqlite_file
from tests.store.builders import CLIENT, NOON, new_surgery

pytestmark = about_the_sqlite_file


@pytest.fixture
def copies(database: Database, tmp_path: Path) -> list[Path]:
    """The database itself, a backup, and a copy as JSON lines, of four events."""
    for _ in range(3):
        new_surgery(database)
    with database.write() as session:
        events.append(session, NOON, CLIENT, "x:done", "x", detail="\u00e9")
    backup, lines = tmp_path / "backup.sqlite", tmp_path / "audit.jsonl"
    back_up(database.url, backup)
    with database.read() as session:
        documents = [event.model_dump(mode="json") for event in audit.all_events(session)]
    lines.write_text("".join(f"{json.dumps(document)}\n" for document in documents))
    return [tmp_path / "database.sqlite", backup, lines]


def test_every_kind_of_copy_is_whole(copies: list[Path]) -> None:
    chains = [verify_file(copy) for copy in copies]
    assert {chain.head for chain in chains} == {chains[0].head}
    assert [(chain.events, chain.is_whole) for chain in chains] == [(4, True)] * 3
    for copy in copies:
        assert verify_file(copy, f"4:{chains[0].head}").is_whole
        assert verify_file(copy, f"3:{chains[0].head}").broken_at == 3


def test_a_changed_copy_is_broken_where_it_was_changed(copies: list[Path]) -> None:
    _, backup, lines = copies
    head = verify_file(lines).head
    with closing(sqlite3.connect(backup)) as connection:
        connection.execute("DROP TRIGGER events_no_update")
        connection.execute("UPDATE events SET address = '10.0.0.1' WHERE seq = 2")
        connection.commit()
    assert verify_file(backup).broken_at == 2
    text = lines.read_text().splitlines(keepends=True)
    lines.write_text("".join(text).replace("x:done", "x:Done"))
    assert verify_file(lines).broken_at == 4
    lines.write_text("".join(text[:3]))
    assert verify_file(lines).is_whole
    assert verify_file(lines, f"4:{head}").broken_at == 4


@pytest.mark.parametrize(
    "content", [b"x", b"[]", b"{}\n", b"\xff\xfe", b"[" * 9000, b"SQLite format 3\0" + bytes(99)]
)
def test_a_file_without_events_is_named(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "file"
    file.write_bytes(content)
    with pytest.raises(AuditFileError, match="file"):
        verify_file(file)
    with pytest.raises(AuditFileError, match="cannot read"):
        verify_file(tmp_path / "none")
    with closing(sqlite3.connect(tmp_path / "other")) as connection:
        connection.execute("CREATE TABLE x (y)")
    with pytest.raises(AuditFileError, match="no events"):
        verify_file(tmp_path / "other")


@pytest.mark.parametrize("define", ["seq", "seq, at", "seq, at, hash", "seq TEXT, at BLOB, hash REAL, id"])
def test_a_database_of_other_tables_is_named(tmp_path: Path, define: str) -> None:
    file = tmp_path / "file"
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("CREATE TABLE x (seq INTEGER PRIMARY KEY AUTOINCREMENT)")  # makes sqlite_sequence
        connection.execute("INSERT INTO sqlite_sequence VALUES ('events', 'x')")
        connection.execute(f"CREATE TABLE events ({define})")
        connection.commit()
    with pytest.raises(AuditFileError, match="no events"):
        verify_file(file)


def test_a_file_that_never_ends_is_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (Path("/dev/zero"), tmp_path / "pipe"):
        with pytest.raises(AuditFileError, match="device, pipe or socket"):
            verify_file(path)
    large = tmp_path / "large"
    large.touch()
    os.truncate(large, 1 << 40)
    with pytest.raises(AuditFileError, match=r"line 1 of .* is longer"):
        verify_file(large)


@pytest.mark.parametrize(
    "expected",
    [
        "", "1", "1:ab", "x:" + "0" * 64, "-1:" + "0" * 64, "9223372036854775808:" + "a" * 64,
        "1" * 5000 + ":" + "a" * 64, "1:" + "g" * 64, "\xb2:" + "0" * 64,
    ],
)  # fmt: skip
def test_what_is_expected_is_a_number_and_a_hash(copies: list[Path], expected: str) -> None:
    with pytest.raises(AuditFileError, match="NUMBER:HASH"):
        verify_file(copies[0], expected)
