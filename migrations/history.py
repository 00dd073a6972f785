"""Alembic from Python: no ini file, so that it works from any directory."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection

from store.database import Database, sqlite_path
from store.errors import DatabaseNotReadyError


def upgrade(url: str) -> None:
    """Bring a database to the newest revision, all steps or none; an SQLite file and its folder are created.

    Raises ``DatabaseNotReadyError`` when the database is at a revision that this version does not have.
    """
    path = sqlite_path(url)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
    database = Database(url)
    try:
        with database.write() as session:
            command.upgrade(config(session.connection()), "head")
    except CommandError as error:
        raise DatabaseNotReadyError(
            "the database was made by another version of Spinewatch; use that version or restore a backup"
        ) from error
    finally:
        database.close()


def head() -> str:
    """Return the newest revision."""
    return ScriptDirectory.from_config(config()).get_current_head() or ""


def config(connection: Connection | None = None) -> Config:
    """Return Alembic's configuration for a connection whose transaction is the caller's."""
    configuration = Config()
    configuration.set_main_option("script_location", str(Path(__file__).parent).replace("%", "%%"))
    configuration.set_main_option("file_template", "r%%(rev)s_%%(slug)s")
    configuration.attributes["connection"] = connection
    return configuration
