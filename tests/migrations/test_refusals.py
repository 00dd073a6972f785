"""What a migrated database refuses to change."""

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from migrations.history import upgrade
from store.database import Database
from store.revision import REVISION
from tests.migrations.databases import move
from tests.store.builders import claimed, new_stage, new_surgery, succeed

RECORD = ("events", "images", "stages", "measurements", "triads", "features")


@pytest.mark.parametrize("table", RECORD)
def test_no_row_of_the_record_can_be_changed_or_deleted(empty: Database, table: str) -> None:
    upgrade(empty.url)
    succeed(empty, claimed(empty, new_stage(empty, new_surgery(empty)).job.id))
    with empty.read() as session:
        column = session.execute(text(f"SELECT * FROM {table}")).keys()  # noqa: S608
    statements = [f"DELETE FROM {table}", *(f"UPDATE {table} SET {name} = {name}" for name in column)]  # noqa: S608
    if empty.engine.dialect.name == "postgresql":
        statements.append(f"TRUNCATE {table} CASCADE")
    else:
        statements.append(f"INSERT OR REPLACE INTO {table} SELECT * FROM {table}")  # noqa: S608
    for statement in statements:
        with pytest.raises(IntegrityError, match=r"never changes|follows"), empty.write() as session:
            session.execute(text(statement))


@pytest.mark.parametrize("revision", ["0004", REVISION])
def test_no_migration_lets_calibrations_change(old: Database, revision: str) -> None:
    upgrade(old.url)
    move(old, revision)
    for table in ("calibrations", "calibration_requests", "calibration_shots", "calibration_reports"):
        with pytest.raises(IntegrityError, match="never change"), old.write() as session:
            session.execute(text(f"DELETE FROM {table}"))  # noqa: S608
