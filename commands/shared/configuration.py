"""Settings from the environment and the command's options, and the log that goes with them."""

from __future__ import annotations

import logging
import sys
from typing import TYPE_CHECKING, Any

from spinewatch.errors import SpinewatchError

if TYPE_CHECKING:
    from settings import Settings


class SettingsError(SpinewatchError):
    """A setting has a value that cannot be used."""

    code = "invalid-setting"


def load_settings(**options: Any) -> Settings:
    """Return the settings, an option before its environment variable; raise ``SettingsError``."""
    from pydantic import ValidationError  # noqa: PLC0415 - --help can do without

    from settings import Settings  # noqa: PLC0415

    try:
        return Settings(**{key: value for key, value in options.items() if value is not None})
    except ValidationError as error:
        doubts = "; ".join(f"SPINEWATCH_{str(e['loc'][0]).upper()}: {e['msg']}" for e in error.errors())
        raise SettingsError(f"{doubts}; see docs/operations.md") from error


def require_record(settings: Settings) -> None:
    """Raise ``DatabaseNotReadyError`` unless the database has the tables that this version works with."""
    from store.database import Database  # noqa: PLC0415 - --help can do without
    from store.revision import require_revision  # noqa: PLC0415

    record = Database(settings.database_url)
    require_revision(record)
    record.close()


def start_log(settings: Settings) -> None:
    """Send everything that is logged to stderr, one line an event."""
    import structlog  # noqa: PLC0415 - --help can do without

    before: list[Any] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.add_log_level,
        structlog.processors.TimeStamper(fmt="iso", utc=True),
    ]
    if settings.log_format == "json":
        last: list[Any] = [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]
    else:
        plain = structlog.dev.plain_traceback
        last = [structlog.dev.ConsoleRenderer(colors=sys.stderr.isatty(), exception_formatter=plain)]
    structlog.configure(
        processors=[*before, structlog.stdlib.ProcessorFormatter.wrap_for_formatter],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=True,
    )
    handler = logging.StreamHandler(sys.stderr)
    remove_meta = structlog.stdlib.ProcessorFormatter.remove_processors_meta
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(foreign_pre_chain=before, processors=[remove_meta, *last])
    )
    logging.basicConfig(level=settings.log_level.upper(), handlers=[handler], force=True)
    for chatty in ("uvicorn", "huey", "alembic"):
        logging.getLogger(chatty).setLevel(logging.WARNING)
