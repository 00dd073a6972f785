"""Whether a database has the tables that this version works with."""

from __future__ import annotations

import os

from sqlalchemy import text
from sqlalchemy.exc import SQLAlchemyError

from store.database import Database, sqlite_path
from store.errors import DatabaseNotReadyError

REVISION = "0021"
"""The migration that makes the tables of store/tables/."""

_ADVICE = "run: spinewatch db upgrade"


def require_revision(database: Database) -> None:
    """Check that a database can be read and is at ``REVISION``.

    Parameters
    ----------
    database
        The database.

    Raises
    ------
    DatabaseNotReadyError
        It is missing, cannot be read, or is at another revision.
    """
    found = current_revision(database)
    if found is None:
        raise DatabaseNotReadyError(f"the database is missing or has no tables; {_ADVICE}")
    if found != REVISION:
        raise DatabaseNotReadyError(
            f"the database is at {found!r}, this version needs {REVISION!r}; {_ADVICE}"
        )


def current_revision(database: Database) -> str | None:
    """Return the revision of a database.

    Parameters
    ----------
    database
        The database.

    Returns
    -------
    str or None
        The revision, None when there is none or the database cannot be read.
    """
    path = sqlite_path(database.url)
    if path is not None and not os.path.exists(path):
        return None  # connecting would create an empty file
    try:
        with database.engine.connect() as connection:
            return connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one_or_none()
    except SQLAlchemyError:
        return None
