from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from store import events, step_times
from store.commits import Commits
from store.database import Database
from tests.backends import about_the_sqlite_file
from tests.store.builders import CLIENT, NOON


@about_the_sqlite_file
def test_each_event_is_seen_once_when_it_is_committed(database: Database) -> None:
    commits = database.commits()
    assert commits.are_seen
    assert commits.happened()
    assert not commits.happened()
    with database.write() as session:
        events.append(session, NOON, CLIENT, events.Action.SURGERY_CREATED, "1")
        session.flush()
        assert not commits.happened()
    assert commits.happened()
    assert not commits.happened()
    commits.close()
    assert commits.happened()
    commits.close()


@about_the_sqlite_file
def test_a_commit_without_an_event_is_not_seen(database: Database) -> None:
    commits = database.commits()
    assert commits.happened()
    with database.write() as session:
        step_times.add(session, "stage", {"match": 1.0})
    assert not commits.happened()
    commits.close()


@about_the_sqlite_file
def test_it_is_not_known_while_the_database_is_held(database: Database, tmp_path: Path) -> None:
    commits = database.commits()
    database.close()
    with closing(sqlite3.connect(tmp_path / "database.sqlite", isolation_level=None)) as other:
        other.execute("PRAGMA locking_mode=EXCLUSIVE")
        other.execute("BEGIN EXCLUSIVE")
        assert commits.happened()
        assert commits.happened()
    commits.close()


def test_a_file_that_is_not_there_is_not_made(tmp_path: Path) -> None:
    commits = Commits(tmp_path / "none.sqlite")
    assert commits.happened()
    assert commits.happened()
    assert list(tmp_path.iterdir()) == []


def test_a_database_that_does_not_tell_may_always_have_changed() -> None:
    commits = Commits(None)
    assert not commits.are_seen
    assert commits.happened()
    assert commits.happened()
