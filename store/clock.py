"""Time in the database: always UTC, always aware."""

from __future__ import annotations

from datetime import UTC, datetime

from sqlalchemy import DateTime, Dialect
from sqlalchemy.types import TypeDecorator


def utc_now() -> datetime:
    """Return the current time.

    Returns
    -------
    datetime
        Aware, UTC.
    """
    return datetime.now(UTC)


class UtcDateTime(TypeDecorator[datetime]):
    """A column of aware UTC times, also on databases that drop the zone."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Return an aware time in UTC, as it is stored.

        Parameters
        ----------
        value
            The time; a naive one is a programming error.
        dialect
            The kind of database.

        Returns
        -------
        datetime or None
            The time in UTC.

        Raises
        ------
        ValueError
            The time is naive.
        """
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError("the database stores aware times only; give the time a zone")
        return value.astimezone(UTC)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Return a stored time as aware UTC.

        Parameters
        ----------
        value
            The stored time.
        dialect
            The kind of database.

        Returns
        -------
        datetime or None
            The time in UTC.
        """
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)
