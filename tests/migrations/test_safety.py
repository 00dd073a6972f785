"""What an upgrade leaves alone, and the copy that it makes before."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import text

from migrations.history import upgrade
from store.database import Database, sqlite_path
from store.errors import DatabaseNotReadyError
from tests.migrations.databases import move


def test_a_database_of_another_version_is_left_alone(database: Database) -> None:
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = 'future'"))
    with pytest.raises(DatabaseNotReadyError, match="another version"):
        upgrade(database.url)


def test_a_database_of_another_program_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "places.sqlite"
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("CREATE TABLE bookmarks (x)")
        connection.commit()
    with pytest.raises(DatabaseNotReadyError, match="another program"):
        upgrade(f"sqlite:///{file}")
    with closing(sqlite3.connect(file)) as connection:
        assert connection.execute("SELECT name FROM sqlite_master").fetchall() == [("bookmarks",)]


def test_a_copy_of_the_database_is_made_before_a_migration(old: Database) -> None:
    path = sqlite_path(old.url)
    copy = upgrade(old.url)
    if path is None:  # on a server, whose administrator makes the copies
        assert copy is None
        return
    assert copy == path.with_name("x-revision-0004.sqlite")
    assert copy.stat().st_mode & 0o777 == 0o600
    with closing(sqlite3.connect(copy)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert connection.execute("SELECT version_num FROM alembic_version").fetchall() == [("0004",)]
        assert connection.execute("SELECT count(*) FROM triads").fetchall() == [(2,)]
    assert upgrade(old.url) is None
    move(old, "0005")
    again = upgrade(old.url)
    assert again == path.with_name("x-revision-0005.sqlite")
    move(old, "0005")
    assert upgrade(old.url) == path.with_name("x-revision-0005-1.sqlite")
    move(old, "0005")
    assert upgrade(old.url, keep_copy=False) is None
