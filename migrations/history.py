"""Alembic from Python: no ini file, so that it works from any directory."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection, inspect

from spinewatch.progress import Progress, silent
from store.backup import back_up
from store.database import Database, create_private, sqlite_path
from store.errors import DatabaseNotReadyError
from store.queue import TABLE_PREFIX as QUEUE_PREFIX
from store.revision import current_revision


def upgrade(url: str, *, keep_copy: bool = True, progress: Progress = silent) -> Path | None:
    """Bring a database to the newest revision, all steps or none; an SQLite file and its folder are created.

    Before a migration, a copy of an SQLite database is made beside it, named by its revision, and returned. A file
    that exists is given to its owner alone. Raises ``DatabaseNotReadyError`` when the database is at a revision that
    this version does not have, or belongs to another program, and ``BackupError`` when the copy cannot be made.
    """
    path = sqlite_path(url)
    if path is not None:
        create_private(path)
    database = Database(url)
    try:
        found = current_revision(database)
        if found is None:
            _require_no_tables(database)
        copy = None
        if path is not None and keep_copy and found is not None and _can_migrate(found):
            copy = _copy_name(path, found)
            back_up(url, copy, progress)
        with database.write(patient=True) as session:
            command.upgrade(config(session.connection()), "head")
    except CommandError as error:
        raise DatabaseNotReadyError(
            f"the database is at revision {found}, which this version ({head()}) does not have: another version of"
            " Spinewatch made it; use that version or restore a backup"
        ) from error
    finally:
        database.close()
    return copy


def _can_migrate(revision: str) -> bool:
    """Return whether a revision is an earlier one of this history."""
    earlier = {script.revision for script in ScriptDirectory.from_config(config()).walk_revisions()}
    return revision != head() and revision in earlier


def _require_no_tables(database: Database) -> None:
    """Raise ``DatabaseNotReadyError`` when a database without a revision has tables."""
    tables = inspect(database.engine).get_table_names()
    foreign = [name for name in tables if name != "alembic_version" and not name.startswith(QUEUE_PREFIX)]
    if foreign and current_revision(database) is None:  # another host may have made them meanwhile
        raise DatabaseNotReadyError(
            f"the database has tables of another program ({foreign[0]}); set SPINEWATCH_DATABASE_URL to one of its own"
        )


def _copy_name(path: Path, revision: str) -> Path:
    names = (f"{path.stem}-revision-{revision}{f'-{n}' if n else ''}{path.suffix}" for n in range(1000))
    return next(copy for name in names if not (copy := path.with_name(name)).exists())


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
