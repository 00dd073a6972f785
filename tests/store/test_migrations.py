from pathlib import Path
from typing import Any

import pytest
from alembic import command
from sqlalchemy import inspect, text
from sqlalchemy.exc import IntegrityError

from migrations.history import config, head, upgrade
from store.database import Database
from store.errors import DatabaseNotReadyError
from store.revision import REVISION, current_revision, require_revision


def test_the_newest_migration_is_the_one_that_the_record_asks_for(record: Database) -> None:
    assert head() == REVISION == current_revision(record)
    require_revision(record)


def test_the_migrations_make_the_tables_of_the_orm(record: Database) -> None:
    with record.writing() as session:
        command.check(config(session.connection()))


def test_upgrading_twice_changes_nothing(record: Database) -> None:
    before = inspect(record.engine).get_table_names()
    upgrade(record.url)
    assert inspect(record.engine).get_table_names() == before


def test_the_way_back_leaves_no_table(record: Database) -> None:
    with record.writing() as session:
        command.downgrade(config(session.connection()), "base")
    assert inspect(record.engine).get_table_names() == ["alembic_version"]


def test_what_was_recorded_before_calibrations_came_from_pictures_is_kept(tmp_path: Path) -> None:
    record = Database(f"sqlite:///{tmp_path / 'old.sqlite'}")
    with record.writing() as session:
        command.upgrade(config(session.connection()), "0001")
        for statement in OLD:
            session.execute(text(statement))
    before = contents(record)
    upgrade(record.url)
    after = contents(record)
    assert [
        {key: row[key] for key in old} for old, row in zip(before["jobs"], after["jobs"], strict=True)
    ] == (before["jobs"])
    assert after["jobs"][0]["calibration_request_id"] is None
    assert after["calibrations"] == [{**before["calibrations"][0], "calibrated_at": None}]
    assert after["measurements"] == [{**before["measurements"][0], "rig_check": None}]
    for broken in (
        "UPDATE jobs SET progress = 2",
        "UPDATE jobs SET state = 'lost'",
        "UPDATE jobs SET stage_id = NULL",
        "UPDATE jobs SET stage_id = 'none'",
        "INSERT INTO jobs SELECT 'k', stage_id, state, progress, step, error, attempts, lease_owner, lease_until,"
        " rung_at, created_at, started_at, finished_at, calibration_request_id FROM jobs",
    ):
        with pytest.raises(IntegrityError), record.writing() as session:
            session.execute(text(broken))
    assert "ix_jobs_state_rung_at" in {index["name"] for index in inspect(record.engine).get_indexes("jobs")}
    with record.writing() as session:
        command.downgrade(config(session.connection()), "0001")
    assert contents(record) == before
    record.close()


OLD = (
    """INSERT INTO calibrations VALUES ('c', 'cart', '{"name": "cart"}', '2026-11-21 12:00:00')""",
    """INSERT INTO images VALUES ('a', x'01', 'image/png', 1, 1, 1, '2026-11-21 12:00:00')""",
    """INSERT INTO surgeries VALUES ('s', 'case', '["L1"]', 'L1', 'x', '2026-11-21 12:00:00')""",
    """INSERT INTO stages VALUES ('t', 's', 'PRE', 1, 'c', 'a', 'a', NULL, '2026-11-21 12:00:00')""",
    """INSERT INTO jobs VALUES ('j', 't', 'failed', 0.25, 'match', '{"code": "x", "detail": "y"}', 2, NULL, NULL,
       '2026-11-21 12:00:01', '2026-11-21 12:00:00', '2026-11-21 12:00:02', '2026-11-21 12:00:03')""",
    """INSERT INTO measurements VALUES ('t', '[]', '{}', '{}', '{}', '0.1.0', '2026-11-21 12:00:03')""",
)


def contents(record: Database) -> dict[str, list[dict[str, Any]]]:
    with record.reading() as session:
        return {
            table: [dict(row) for row in session.execute(text(f"SELECT * FROM {table}")).mappings()]  # noqa: S608
            for table in ("calibrations", "images", "surgeries", "stages", "jobs", "measurements")
        }


def test_a_database_of_another_version_is_left_alone(record: Database) -> None:
    with record.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = 'future'"))
    with pytest.raises(DatabaseNotReadyError, match="another version"):
        upgrade(record.url)
    with pytest.raises(DatabaseNotReadyError, match="db upgrade"):
        require_revision(record)


def test_a_file_that_is_no_database_is_named(tmp_path: Path) -> None:
    file = tmp_path / "x.sqlite"
    file.write_bytes(b"not a database" * 100)
    record = Database(f"sqlite:///{file}")
    with pytest.raises(DatabaseNotReadyError):
        require_revision(record)
    record.close()
