"""Types of query and form parameters, which arrive as text."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Query
from pydantic import BeforeValidator

_RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d[Tt]\d\d:\d\d:\d\d(\.\d{1,6})?([Zz]|[+-]\d\d:\d\d)", re.ASCII)


def parse_time(value: Any) -> Any:
    """Return an RFC 3339 time with a zone as a UTC ``datetime``; a value that is not text is left to pydantic."""
    if not isinstance(value, str):
        return value
    if not _RFC_3339.fullmatch(value):
        raise ValueError("not an RFC 3339 time with a time zone; write it like 2026-11-21T09:30:00Z")
    try:
        return datetime.fromisoformat(value.upper()).astimezone(UTC)
    except OverflowError as error:
        raise ValueError("outside the years 1 to 9999") from error


TextTime = Annotated[datetime, BeforeValidator(parse_time)]
"""A time in a query or a form."""

Limit = Annotated[int, Query(ge=1, le=200, description="Maximum number of items to return.")]
Offset = Annotated[int, Query(ge=0, le=2**31, description="Number of items to skip, from the oldest.")]
