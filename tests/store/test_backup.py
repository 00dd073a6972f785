import os
import sqlite3
import subprocess
import sys
import threading
from contextlib import closing
from datetime import timedelta
from pathlib import Path

import pytest
from sqlalchemy import select, text

from contract.event import Actor, ActorKind
from contract.key import NewKey, Scope
from migrations.history import upgrade
from store import keys, sessions
from store.backup import back_up, restore
from store.database import Database, sqlite_path
from store.digests import TABLE
from store.errors import BackupError
from store.revision import require_revision
from store.tables.surgeries import Surgery
from store.verification import verify
from tests.backends import about_the_sqlite_file
from tests.store.builders import NOON, new_stage, new_surgery

pytestmark = about_the_sqlite_file

WRITER = """
import sqlite3, sys, time
connection = sqlite3.connect(sys.argv[1])
connection.execute("PRAGMA user_version")
connection.execute("SELECT * FROM alembic_version").fetchall()
print("open", flush=True)
sys.stdin.read()
"""


def surgery_ids(url: str) -> set[str]:
    database = Database(url)
    try:
        with database.read() as session:
            return set(session.scalars(select(Surgery.id)))
    finally:
        database.close()


def file_of(database: Database) -> Path:
    path = sqlite_path(database.url)
    assert path is not None
    return path


def test_a_copy_has_everything_and_only_its_owner_may_read_it(database: Database, tmp_path: Path) -> None:
    surgery = new_surgery(database)
    new_stage(database, surgery)
    copy = tmp_path / "copy.sqlite"
    seen: list[float] = []
    size = back_up(database.url, copy, lambda _, fraction: seen.append(fraction))
    assert size == copy.stat().st_size > 0
    assert copy.stat().st_mode & 0o777 == 0o600
    assert seen == sorted(seen)
    assert surgery_ids(f"sqlite:///{copy}") == {surgery}


def test_a_copy_is_consistent_while_others_write_without_pause(database: Database, tmp_path: Path) -> None:
    stop = threading.Event()
    surgery = new_surgery(database)
    written: list[str] = []

    def write() -> None:
        while not stop.is_set():
            n = len(written)
            pair = (os.urandom(200_000), os.urandom(200_000))
            written.append(new_stage(database, surgery, f"S{n}", pair).id)

    threads = [threading.Thread(target=write)]
    for thread in threads:
        thread.start()
    try:
        found = []
        for n in range(5):
            before = len(written)
            back_up(database.url, tmp_path / f"{n}.sqlite")
            verification = verify(tmp_path / f"{n}.sqlite")
            with closing(sqlite3.connect(tmp_path / f"{n}.sqlite")) as copy:
                (torn,) = copy.execute(
                    "SELECT count(*) FROM stages WHERE id NOT IN (SELECT subject_id FROM jobs)"
                ).fetchone()
            found.append((verification.stages >= before, verification.problems, torn))
    finally:
        stop.set()
        for thread in threads:
            thread.join()
    assert found == [(True, (), 0)] * 5


def test_a_file_that_exists_is_left_alone(database: Database, tmp_path: Path) -> None:
    copy = tmp_path / "copy.sqlite"
    copy.write_text("mine")
    with pytest.raises(BackupError, match="exists"):
        back_up(database.url, copy)
    assert copy.read_text() == "mine"


def test_a_failure_leaves_no_file(database: Database, tmp_path: Path) -> None:
    file_of(database).write_bytes(b"not a database, but longer than its header" * 200)
    folder = tmp_path / "backups"
    folder.mkdir()
    with pytest.raises(BackupError, match="cannot be copied"):
        back_up(database.url, folder / "copy.sqlite")
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("url", "target", "message"),
    [
        ("postgresql://host/name", "copy", "pg_dump"),
        ("sqlite:///nowhere/x.sqlite", "copy", "there is no database"),
        (None, "nowhere/copy", "there is no folder"),
    ],
)
def test_what_cannot_be_copied_is_named(
    database: Database, tmp_path: Path, url: str | None, target: str, message: str
) -> None:
    with pytest.raises(BackupError, match=message):
        back_up(url or database.url, tmp_path / target)


def test_a_restored_database_is_the_copy_and_the_old_one_is_kept(database: Database, tmp_path: Path) -> None:
    first = new_surgery(database)
    copy = tmp_path / "copy.sqlite"
    back_up(database.url, copy)
    second = new_surgery(database)
    database.close()
    with pytest.raises(BackupError, match="--replace"):
        restore(database.url, copy, NOON, replace=False)
    assert surgery_ids(database.url) == {first, second}
    kept = restore(database.url, copy, NOON, replace=True).kept
    assert kept is not None
    assert kept.name == "database-replaced-20261121T120000Z.sqlite"
    assert surgery_ids(database.url) == {first}
    assert surgery_ids(f"sqlite:///{kept}") == {first, second}
    assert len(list(tmp_path.iterdir())) == 3
    assert file_of(database).stat().st_mode & 0o777 == 0o600
    again = restore(database.url, copy, NOON, replace=True).kept
    assert again is not None
    assert again != kept
    assert {path.name for path in tmp_path.iterdir()} == {copy.name, kept.name, again.name, "database.sqlite"}


def test_a_restored_database_works(database: Database, tmp_path: Path) -> None:
    back_up(database.url, tmp_path / "copy.sqlite")
    url = f"sqlite:///{tmp_path / 'new' / 'place.sqlite'}"
    assert restore(url, tmp_path / "copy.sqlite", NOON, replace=False).kept is None
    upgrade(url)
    restored = Database(url)
    require_revision(restored)
    new_stage(restored, new_surgery(restored))
    restored.close()


def tables_of(file: Path) -> set[str]:
    with closing(sqlite3.connect(file)) as connection:
        return {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}


def test_only_a_backup_has_digests(database: Database, tmp_path: Path) -> None:
    new_stage(database, new_surgery(database))
    copy, again = tmp_path / "copy.sqlite", tmp_path / "again.sqlite"
    back_up(database.url, copy)
    database.close()
    before = tables_of(file_of(database))
    assert tables_of(copy) == {*before, TABLE}
    content = copy.read_bytes()
    restore(database.url, copy, NOON, replace=True)
    assert copy.read_bytes() == content
    assert tables_of(file_of(database)) == before
    assert verify(file_of(database)).problems == ()
    back_up(database.url, again)
    assert verify(again).has_digests


def test_a_backup_of_an_earlier_version_is_restored(database: Database, tmp_path: Path) -> None:
    surgery = new_surgery(database)
    database.close()
    copy = tmp_path / "copy.sqlite"
    with closing(sqlite3.connect(file_of(database))) as connection:
        connection.execute("VACUUM INTO ?", (str(copy),))
    restore(database.url, copy, NOON, replace=True)
    assert file_of(database).read_bytes() == copy.read_bytes()
    assert surgery_ids(database.url) == {surgery}


def test_what_is_no_database_is_not_restored(database: Database, tmp_path: Path) -> None:
    surgery = new_surgery(database)
    database.close()
    (tmp_path / "letter").write_bytes(b"a letter to somebody" * 500)
    with pytest.raises(BackupError, match="choose another backup"):
        restore(database.url, tmp_path / "letter", NOON, replace=True)
    assert surgery_ids(database.url) == {surgery}
    assert {path.name for path in tmp_path.iterdir()} == {"letter", "database.sqlite"}


def test_a_name_that_is_not_utf_8_is_named(database: Database, tmp_path: Path) -> None:
    with pytest.raises(BackupError, match="not UTF-8; choose another name") as refused:
        back_up(database.url, tmp_path / os.fsdecode(b"\xff.sqlite"))
    assert str(refused.value).isascii()
    assert not any(b"\xff" in name for name in os.listdir(os.fsencode(tmp_path)))


def test_a_database_in_use_is_not_replaced(database: Database, tmp_path: Path) -> None:
    surgery = new_surgery(database)
    copy = tmp_path / "copy.sqlite"
    back_up(database.url, copy)
    database.close()
    command = [sys.executable, "-c", WRITER, str(file_of(database))]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "open\n"
        with pytest.raises(BackupError, match="stop the service"):
            restore(database.url, copy, NOON, replace=True)
        other.communicate()
    assert surgery_ids(database.url) == {surgery}
    assert [
        path.name for path in tmp_path.iterdir() if "restor" in path.name or "replaced" in path.name
    ] == []


def test_a_broken_database_is_replaced_and_kept(database: Database, tmp_path: Path) -> None:
    surgery = new_surgery(database)
    copy = tmp_path / "copy.sqlite"
    back_up(database.url, copy)
    database.close()
    file_of(database).write_bytes(b"broken" * 500)
    kept = restore(database.url, copy, NOON, replace=True).kept
    assert kept is not None
    assert kept.read_bytes() == b"broken" * 500
    assert surgery_ids(database.url) == {surgery}


def test_what_was_only_in_the_write_ahead_log_is_kept_too(database: Database, tmp_path: Path) -> None:
    back_up(database.url, tmp_path / "copy.sqlite")
    database.close()
    code = (
        "import os, sys, sqlite3; c = sqlite3.connect(sys.argv[1]); c.execute('PRAGMA journal_mode=WAL');"
        "c.execute('CREATE TABLE late (x)'); c.commit(); os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", code, str(file_of(database))], check=True)
    kept = restore(database.url, tmp_path / "copy.sqlite", NOON, replace=True).kept
    old = Database(f"sqlite:///{kept}")
    with old.read() as session:
        assert session.scalars(text("SELECT x FROM late")).all() == []
    old.close()


def test_a_restored_backup_lets_in_nobody_who_was_kept_out(database: Database, tmp_path: Path) -> None:
    actor = Actor(kind=ActorKind.COMMAND, name="test")
    with database.write() as session:
        stolen, good = (
            keys.add(session, NewKey(name=name, scopes=[Scope.STAGE_READ]), NOON, actor)[1]
            for name in ("a", "b")
        )
        session.flush()
        row = keys.authenticate(session, good, NOON)
        assert row is not None
        sessions.start(session, row, NOON, timedelta(hours=1), actor)
    back_up(database.url, tmp_path / "copy.sqlite")
    with database.write() as session:
        keys.revoke(session, stolen[3:11], NOON, actor)
    database.close()
    restored = restore(database.url, tmp_path / "copy.sqlite", NOON, replace=True)
    assert (restored.revoked, restored.knows_revocations) == ((stolen[3:11],), True)
    with closing(sqlite3.connect(file_of(database))) as connection:
        assert connection.execute("SELECT count(*) FROM api_sessions").fetchone() == (0,)
    again = Database(database.url)
    with again.read() as session:
        assert keys.authenticate(session, stolen, NOON) is None
        assert keys.authenticate(session, good, NOON) is not None
    again.close()
