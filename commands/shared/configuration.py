"""Settings from options and the environment, and the log of a process."""

from __future__ import annotations

import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from commands.shared.repeated_events import RepeatedEvents
from spinewatch.errors import SpinewatchError

if TYPE_CHECKING:
    from settings import Settings


class SettingsError(SpinewatchError):
    """A setting has an invalid value."""

    code = "invalid-setting"


def load_settings(**options: Any) -> Settings:
    """Return the settings; an option overrides its environment variable. Raises ``SettingsError``."""
    from pydantic import ValidationError  # noqa: PLC0415 - --help does not need it

    from settings import PREFIX, Settings, unknown_variables  # noqa: PLC0415

    if unknown := unknown_variables(os.environ):
        problems = "; ".join(
            f"there is no setting {name}" + (f", did you mean {nearest}?" if nearest else "")
            for name, nearest in unknown.items()
        )
        raise SettingsError(f"{problems}; see docs/operations.md")
    try:
        return Settings(**{key: value for key, value in options.items() if value is not None})
    except ValidationError as error:
        problems = "; ".join(
            f"{PREFIX}{str(e['loc'][0]).upper()}: {e['msg'].removeprefix('Value error, ')}"
            for e in error.errors()
        )
        raise SettingsError(f"{problems}; see docs/operations.md") from error


def require_database(settings: Settings) -> None:
    """Raise ``DatabaseNotReadyError`` unless the database has the tables of this version and can be written."""
    from sqlalchemy.exc import SQLAlchemyError  # noqa: PLC0415 - --help does not need it

    from store.database import Database, sqlite_path  # noqa: PLC0415
    from store.revision import require_revision  # noqa: PLC0415

    database = Database(settings.database_url)
    try:
        path = sqlite_path(settings.database_url)
        if path is None or os.path.exists(path):  # connecting would create an empty file
            with database.write() as session:
                session.connection()  # takes the write lock and changes nothing
        require_revision(database)
    except SQLAlchemyError as error:
        raise _database_error("written", error) from error
    finally:
        database.close()


def migrate_database(settings: Settings, *, keep_copy: bool = True) -> Path | None:
    """Create the database or migrate it to this version; return the copy made before a migration, if any.

    Raises ``DatabaseNotReadyError`` or ``BackupError`` if that is impossible.
    """
    from sqlalchemy.exc import SQLAlchemyError  # noqa: PLC0415 - --help does not need it

    from commands.shared.terminal_progress import terminal_progress  # noqa: PLC0415
    from migrations.history import upgrade  # noqa: PLC0415

    try:
        with terminal_progress() as progress:
            return upgrade(settings.database_url, keep_copy=keep_copy, progress=progress)
    except (OSError, SQLAlchemyError) as error:
        raise _database_error("created or migrated", error) from error


def checkpoint(settings: Settings) -> None:
    """Write everything into the database's one file, after the last process that used it has ended."""
    from store.database import Database  # noqa: PLC0415 - --help does not need it

    database = Database(settings.database_url)
    database.checkpoint()
    database.close()


def _database_error(verb: str, error: Exception) -> SpinewatchError:
    """Return the one-line error of a database that cannot be used."""
    from sqlalchemy.exc import DBAPIError  # noqa: PLC0415 - --help does not need it

    from store.errors import DatabaseNotReadyError  # noqa: PLC0415

    if isinstance(error, OSError):
        reason = f"{error.strerror}: {error.filename}"
    else:
        reason = str(error.orig if isinstance(error, DBAPIError) else error).partition("\n")[0]
    return DatabaseNotReadyError(
        f"the database cannot be {verb}: {reason}; check the file, its folder and SPINEWATCH_DATABASE_URL"
    )


def require_queue(settings: Settings) -> None:
    """Raise ``QueueURLError`` unless the URL of the queue can be used and the queue answers."""
    import sqlite3  # noqa: PLC0415 - --help does not need these

    from psycopg import Error as PostgresError  # noqa: PLC0415
    from redis import RedisError  # noqa: PLC0415

    from store.errors import QueueURLError  # noqa: PLC0415
    from store.queue import JobQueue  # noqa: PLC0415

    queue = JobQueue(settings.queue)
    try:
        queue.length()
    except (RedisError, PostgresError, sqlite3.Error) as error:
        reason = str(error).partition("\n")[0].rstrip(".")
        raise QueueURLError(
            f"the queue does not answer: {reason}; start its server, or check SPINEWATCH_QUEUE_URL"
        ) from error
    finally:
        queue.close()


def start_log(settings: Settings) -> None:
    """Send all log records to stderr, one line per event."""
    import structlog  # noqa: PLC0415 - --help does not need it

    shared: list[Any] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
    ]
    if settings.log_format == "json":
        render: list[Any] = [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]
    else:
        plain = structlog.dev.plain_traceback
        render = [structlog.dev.ConsoleRenderer(colors=sys.stderr.isatty(), exception_formatter=plain)]
    structlog.configure(
        processors=[*shared, structlog.stdlib.ProcessorFormatter.wrap_for_formatter],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=True,
    )
    handler = logging.StreamHandler(sys.stderr)
    remove_meta = structlog.stdlib.ProcessorFormatter.remove_processors_meta
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(foreign_pre_chain=shared, processors=[remove_meta, *render])
    )
    handler.addFilter(RepeatedEvents())
    logging.basicConfig(level=settings.log_level.upper(), handlers=[handler], force=True)
    for verbose in ("uvicorn", "huey", "alembic"):
        logging.getLogger(verbose).setLevel(logging.WARNING)
