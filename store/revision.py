"""Whether a database has the tables that this version works with."""

from __future__ import annotations

from sqlalchemy import text
from sqlalchemy.exc import SQLAlchemyError

from store.database import Database, sqlite_path
from store.errors import DatabaseNotReadyError

REVISION = "0004"
"""The migration that makes the tables of store/tables.py."""

_ADVICE = "run: spinewatch db upgrade"


def require_revision(record: Database) -> None:
    """Raise ``DatabaseNotReadyError`` unless the database can be read and is at ``REVISION``."""
    found = current_revision(record)
    if found is None:
        raise DatabaseNotReadyError(f"the database is missing or has no tables; {_ADVICE}")
    if found != REVISION:
        raise DatabaseNotReadyError(
            f"the database is at {found!r}, this version needs {REVISION!r}; {_ADVICE}"
        )


def current_revision(record: Database) -> str | None:
    """Return the revision of the database, None when there is none or it cannot be read."""
    path = sqlite_path(record.url)
    if path is not None and not path.exists():
        return None  # connecting would make an empty file
    try:
        with record.engine.connect() as connection:
            return connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one_or_none()
    except SQLAlchemyError:
        return None
