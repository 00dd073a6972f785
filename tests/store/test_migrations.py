from pathlib import Path

import pytest
from alembic import command
from sqlalchemy import inspect, text

from migrations.history import config, head, upgrade
from store.errors import RecordNotReadyError
from store.record import Record
from store.revision import REVISION, current_revision, require_revision


def test_the_newest_migration_is_the_one_that_the_record_asks_for(record: Record) -> None:
    assert head() == REVISION == current_revision(record)
    require_revision(record)


def test_the_migrations_make_the_tables_of_the_orm(record: Record) -> None:
    with record.writing() as session:
        command.check(config(session.connection()))


def test_upgrading_twice_changes_nothing(record: Record) -> None:
    before = inspect(record.engine).get_table_names()
    upgrade(record.url)
    assert inspect(record.engine).get_table_names() == before


def test_the_way_back_leaves_no_table(record: Record) -> None:
    with record.writing() as session:
        command.downgrade(config(session.connection()), "base")
    assert inspect(record.engine).get_table_names() == ["alembic_version"]


def test_a_database_of_another_version_is_left_alone(record: Record) -> None:
    with record.writing() as session:
        session.execute(text("UPDATE alembic_version SET version_num = 'future'"))
    with pytest.raises(RecordNotReadyError, match="another version"):
        upgrade(record.url)
    with pytest.raises(RecordNotReadyError, match="db upgrade"):
        require_revision(record)


def test_a_file_that_is_no_database_is_named(tmp_path: Path) -> None:
    file = tmp_path / "x.sqlite"
    file.write_bytes(b"not a database" * 100)
    record = Record(f"sqlite:///{file}")
    with pytest.raises(RecordNotReadyError):
        require_revision(record)
    record.close()
