import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from store.backup import back_up
from store.database import Database
from store.errors import BackupError
from store.revision import REVISION
from store.verification import verify
from tests.backends import about_the_sqlite_file
from tests.store.builders import new_stage, new_surgery

pytestmark = about_the_sqlite_file


@pytest.fixture
def copy(database: Database, tmp_path: Path) -> Path:
    new_stage(database, new_surgery(database), pair=(b"l" * 5000, b"r" * 9000))
    path = tmp_path / "copy.sqlite"
    back_up(database.url, path)
    return path


def change(copy: Path, *statements: str) -> None:
    with closing(sqlite3.connect(copy)) as connection:
        for statement in statements:
            connection.execute(statement)
        connection.commit()


def is_refused(copy: Path) -> bool:
    try:
        return bool(verify(copy).problems)
    except BackupError:
        return True


def test_a_whole_backup_has_no_problem_and_is_not_changed(copy: Path) -> None:
    before = copy.read_bytes()
    seen: list[float] = []
    verification = verify(copy, lambda _, fraction: seen.append(fraction))
    assert verification.problems == ()
    assert (verification.revision, verification.surgeries, verification.stages) == (REVISION, 1, 1)
    assert (verification.images, verification.image_bytes) == (2, 14_000)
    assert seen == sorted(seen)
    assert copy.read_bytes() == before
    assert [path.name for path in copy.parent.glob("copy*")] == [copy.name]


@pytest.mark.parametrize(
    ("statement", "problem"),
    [
        ("UPDATE images SET content = content || 'x' WHERE rowid = 1", "SHA-256"),
        ("UPDATE images SET size_bytes = 1 WHERE rowid = 1", "size"),
        ("DELETE FROM images WHERE rowid = 1", "images that is not there"),
        ("UPDATE alembic_version SET version_num = '9999'", "newer version"),
        ("UPDATE events SET actor_name = 'somebody else' WHERE seq = 1", "the audit is broken"),
        ("DELETE FROM events WHERE seq = (SELECT max(seq) FROM events)", "the audit is broken"),
    ],
)
def test_what_is_wrong_is_named(copy: Path, statement: str, problem: str) -> None:
    with closing(sqlite3.connect(copy)) as connection:
        triggers = connection.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall()
    change(copy, *(f"DROP TRIGGER {name}" for (name,) in triggers), statement)
    assert any(problem in line for line in verify(copy).problems)


def test_a_flipped_bit_of_an_image_is_found(copy: Path) -> None:
    content = copy.read_bytes()
    place = content.index(b"r" * 100)
    copy.write_bytes(content[:place] + b"s" + content[place + 1 :])
    (problem,) = verify(copy).problems
    assert problem.startswith("image ")


def test_damage_of_the_file_is_named(copy: Path) -> None:
    content = copy.read_bytes()
    pages = range(4096, len(content), 4096)
    damaged = 0
    for page in pages:
        torn = content[:page] + b"\0" * 4096 + content[page + 4096 :]
        copy.write_bytes(torn)
        damaged += is_refused(copy)
    assert damaged == len(pages)


def test_a_truncated_copy_is_named(copy: Path) -> None:
    copy.write_bytes(copy.read_bytes()[:-4096])
    assert is_refused(copy)


@pytest.mark.parametrize("content", [b"", b"not a database, but longer than its header" * 20])
def test_another_file_is_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "file").write_bytes(content)
    with pytest.raises(BackupError, match="choose another backup"):
        verify(tmp_path / "file")
    with pytest.raises(BackupError, match="name a backup"):
        verify(tmp_path / "nothing")


def test_a_database_of_another_program_is_named(tmp_path: Path) -> None:
    change(tmp_path / "other.sqlite", "CREATE TABLE bookmarks (x)")
    with pytest.raises(BackupError, match="no tables of Spinewatch"):
        verify(tmp_path / "other.sqlite")


def test_a_plain_copy_of_a_database_in_use_is_named(database: Database, tmp_path: Path) -> None:
    new_surgery(database)
    for ending in ("", "-wal"):
        shutil.copyfile(tmp_path / f"database.sqlite{ending}", tmp_path / f"plain.sqlite{ending}")
    with pytest.raises(BackupError, match="spinewatch backup"):
        verify(tmp_path / "plain.sqlite")
