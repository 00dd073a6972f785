"""Path, query and form parameters: identifiers, and times, which must be plausible."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any

from fastapi import Path, Query
from pydantic import BeforeValidator

from service.problems import InvalidInputError
from spinewatch.errors import SpinewatchError

_EARLIEST = datetime(2000, 1, 1, tzinfo=UTC)
"""Earlier times come from clocks that were never set."""

_RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d[Tt]\d\d:\d\d:\d\d(\.\d{1,32})?([Zz]|[+-]\d\d:\d\d)", re.ASCII)


def parse_time(value: Any) -> Any:
    """Return an RFC 3339 time with a zone as a UTC ``datetime``; a value that is not text is left to pydantic.

    Fractions of a second are cut to microseconds.
    """
    if not isinstance(value, str):
        return value
    if _RFC_3339.fullmatch(value.replace(" ", "+")) and " " in value:
        raise ValueError(
            "the + of the time zone arrived as a space; write it as %2B in a URL, or give the time in UTC"
        )
    if not _RFC_3339.fullmatch(value):
        raise ValueError("not an RFC 3339 time with a time zone; write it like 2026-11-21T09:30:00Z")
    try:
        return datetime.fromisoformat(value.upper()).astimezone(UTC)
    except OverflowError as error:
        raise ValueError("outside the years 1 to 9999") from error


_DECLARED = {"pattern": "^[A-Za-z0-9._-]{1,64}$"}
"""Pattern of identifiers and names in the contract; anything else is not found, so that it is not checked."""

SurgeryId = Annotated[str, Path(description="Identifier of the surgery.", json_schema_extra=_DECLARED)]
CalibrationId = Annotated[
    str, Path(description="Identifier of the calibration.", json_schema_extra=_DECLARED)
]
JobId = Annotated[str, Path(description="Identifier of the job.", json_schema_extra=_DECLARED)]
StagePath = Annotated[str, Path(description="Name of the stage.", json_schema_extra=_DECLARED)]

TakeQuery = Annotated[
    int | None,
    Query(ge=1, le=2**31 - 1, description="Number of the take; by default the latest one that was measured."),
]

PairQuery = Annotated[int, Query(ge=1, le=2**31 - 1, description="Number of the pair in a burst.")]

TextTime = Annotated[datetime, BeforeValidator(parse_time)]
"""A time in a query or a form."""


class TimeImplausibleError(SpinewatchError):
    """A time lies in the future or decades back."""

    code = "time-implausible"


def require_plausible_time(
    name: str, time: datetime | None, now: datetime, tolerance: timedelta, part: str = "body"
) -> None:
    """Raise ``InvalidInputError`` for a time before 2000, or later than now by more than the tolerance of clocks."""
    if time is None or _EARLIEST <= time <= now + tolerance:
        return
    given = time.isoformat(timespec="seconds")
    problem = f"{given} is before {_EARLIEST.year}" if time < _EARLIEST else f"{given} is in the future"
    error = TimeImplausibleError(f"{problem}; set the clock, or leave the time out when it is unknown")
    raise InvalidInputError(name, error, part=part)
