import random
import shutil
import sqlite3
from contextlib import closing
from itertools import product
from pathlib import Path

import pytest

from store.backup import back_up
from store.database import Database
from store.digests import TABLE
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


def drop_triggers(copy: Path) -> None:
    with closing(sqlite3.connect(copy)) as connection:
        triggers = connection.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall()
    change(copy, *(f"DROP TRIGGER {name}" for (name,) in triggers))


def contents(copy: Path) -> list[object]:
    """Return every row of a file, and every definition of a table, as bytes."""
    with closing(sqlite3.connect(copy)) as connection:
        connection.text_factory = bytes
        query = "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY type, name"
        definitions = connection.execute(query).fetchall()
        tables = [name.decode() for kind, name, *_ in definitions if kind == b"table"]
        queries = [f"SELECT * FROM {table}" for table in tables]  # noqa: S608 - our own names
        rows = [sorted(map(repr, connection.execute(query))) for query in queries]
        return [definitions, *rows]


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
    assert verification.has_digests
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
    drop_triggers(copy)
    change(copy, statement)
    assert any(problem in line for line in verify(copy).problems)


def test_a_flipped_bit_of_an_image_is_found(copy: Path) -> None:
    content = copy.read_bytes()
    place = content.index(b"r" * 100)
    copy.write_bytes(content[:place] + b"s" + content[place + 1 :])
    (problem,) = verify(copy).problems
    assert problem.startswith("image ")


@pytest.mark.parametrize(
    ("table", "statement"),
    [
        ("images", "UPDATE images SET width = width + 1 WHERE rowid = 1"),
        ("calibrations", "UPDATE calibrations SET rig = replace(rig, '1', '2')"),
        ("jobs", "UPDATE jobs SET progress = progress + 1e-16"),
        ("jobs", "UPDATE jobs SET payload = CAST(payload AS BLOB)"),
        ("stages", "UPDATE stages SET name = CAST(x'ff' AS TEXT)"),
        ("surgeries", "DELETE FROM surgeries"),
        ("sqlite_master", "CREATE INDEX further ON jobs (step)"),
        ("bookmarks", "CREATE TABLE bookmarks (x)"),
    ],
)
def test_a_table_that_was_changed_is_named(copy: Path, table: str, statement: str) -> None:
    drop_triggers(copy)
    back_up(f"sqlite:///{copy}", copy.with_name("again.sqlite"))
    again = copy.with_name("again.sqlite")
    assert verify(again).problems == ()
    change(again, statement)
    assert any(line.startswith(f"table {table} ") for line in verify(again).problems)


def test_a_flipped_bit_anywhere_is_found_or_changes_nothing(copy: Path) -> None:
    whole, before = copy.read_bytes(), contents(copy)
    used = [place for place, byte in enumerate(whole) if byte]
    chosen = random.Random(7)
    found = 0
    for place in chosen.sample(used, 150):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << chosen.randrange(8)
        copy.write_bytes(flipped)
        refused = is_refused(copy)
        found += refused
        assert refused or contents(copy) == before, f"byte {place}"
    assert found > 100


@pytest.mark.parametrize("size", [1, 512, 4096, 5000])
def test_bytes_after_the_end_are_named(copy: Path, size: int) -> None:
    whole = copy.read_bytes()
    copy.write_bytes(whole + b"x" * size)
    (problem,) = verify(copy).problems
    assert problem == f"the file has {len(whole) + size} bytes instead of {len(whole)}"


def test_a_name_that_is_not_utf_8_is_named(copy: Path) -> None:
    content = copy.read_bytes()
    assert b"actor_name VARCHAR" in content
    copy.write_bytes(content.replace(b"actor_name VARCHAR", b"actor_nam\xe5 VARCHAR"))
    assert is_refused(copy)


def test_a_value_of_another_type_is_named(copy: Path) -> None:
    drop_triggers(copy)
    whole = copy.read_bytes()
    place = "(SELECT rootpage FROM sqlite_master WHERE name = 'other')"
    definition = f"UPDATE sqlite_master SET rootpage = {place} WHERE name = '{{}}'"  # noqa: S608
    columns = ("images.sha256", "images.content", "events.seq", "events.hash", "sqlite_sequence.seq")
    for column, value in product(columns, ("NULL", "1.5", "'text'", "CAST(x'ff' AS TEXT)")):
        table, _, name = column.partition(".")
        copy.write_bytes(whole)
        change(
            copy,
            f"CREATE TABLE other AS SELECT * FROM {table}",  # noqa: S608 - without its constraints
            f"UPDATE other SET {name} = {value}",  # noqa: S608
            "PRAGMA writable_schema = ON",
            definition.format(table),
        )
        assert is_refused(copy)


def test_a_backup_of_an_earlier_version_has_no_digests(copy: Path) -> None:
    change(copy, f"DROP TABLE {TABLE}", "UPDATE jobs SET progress = 0.5")
    verification = verify(copy)
    assert (verification.has_digests, verification.problems) == (False, ())


def test_a_database_in_use_has_no_digests_also_when_it_was_a_backup(copy: Path) -> None:
    database = Database(f"sqlite:///{copy}")
    new_surgery(database)
    database.close()
    verification = verify(copy)
    assert (verification.has_digests, verification.problems, verification.surgeries) == (False, (), 2)
    back_up(database.url, copy.with_name("again.sqlite"))
    again = verify(copy.with_name("again.sqlite"))
    assert (again.has_digests, again.problems, again.surgeries) == (True, (), 2)


def test_damage_of_the_digests_themselves_is_named(copy: Path) -> None:
    change(copy, "DELETE FROM backup_digests WHERE name = 'jobs'")
    assert verify(copy).problems == ("table jobs has no digest",)


def test_a_table_of_digests_with_another_name_is_missed(copy: Path) -> None:
    content = copy.read_bytes()
    name = TABLE.encode()
    copy.write_bytes(content.replace(b"CREATE TABLE " + name, b"CREATE TABLE " + b"c" + name[1:]))
    assert is_refused(copy)


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
