from pathlib import Path

import pytest
from sqlalchemy import text

from store.database import Database
from store.errors import DatabaseNotReadyError
from store.revision import REVISION, current_revision, require_revision


def test_a_current_database_is_ready(database: Database) -> None:
    require_revision(database)
    assert current_revision(database) == REVISION


def test_another_revision_is_refused(database: Database) -> None:
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = 'future'"))
    with pytest.raises(DatabaseNotReadyError, match="db upgrade"):
        require_revision(database)


def test_a_missing_file_is_not_created(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'none.sqlite'}")
    with pytest.raises(DatabaseNotReadyError, match="db upgrade"):
        require_revision(database)
    database.close()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_no_database_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "x.sqlite"
    file.write_bytes(b"not a database" * 100)
    database = Database(f"sqlite:///{file}")
    with pytest.raises(DatabaseNotReadyError):
        require_revision(database)
    database.close()
