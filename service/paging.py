"""Pages of lists: an opaque cursor has the place after which the next page begins, and what it is a page of."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Annotated, Any, Literal, TypeVar

from fastapi import Depends, Query
from pydantic import BaseModel

from contract.job import JobState
from service.etags import IfNoneMatch
from service.parameters import TextTime
from service.problems import InvalidInputError
from spinewatch.errors import SpinewatchError
from store.page import Page, PageRequest, Position, page_of_items

Limit = Annotated[int, Query(ge=1, le=200, description="Maximum number of items to return.")]
CursorText = Annotated[
    str | None,
    Query(max_length=600, description="Where the page begins: `next_cursor` of the page before."),
]
CreatedSort = Annotated[
    Literal["-created_at", "created_at"],
    Query(description="Order: by age, newest first with the minus sign."),
]
StateFilter = Annotated[
    JobState | None, Query(description="Only what has a job in this state: queued, running, succeeded ...")
]
_Time = TextTime | None


@dataclass(frozen=True)
class Part:
    """The part of a list that a request asks for."""

    limit: int
    cursor: str | None
    if_none_match: str | None


async def _part(limit: Limit = 50, cursor: CursorText = None, if_none_match: IfNoneMatch = None) -> Part:
    return Part(limit, cursor, if_none_match)


async def _created(
    created_after: Annotated[
        _Time, Query(description="Only what was created at this time or later; RFC 3339 with a zone.")
    ] = None,
    created_before: Annotated[_Time, Query(description="Only what was created before this time.")] = None,
) -> Mapping[str, datetime | None]:
    return {"created_after": created_after, "created_before": created_before}


PartDep = Annotated[Part, Depends(_part)]
"""The query parameters `limit` and `cursor`, and the header `If-None-Match`."""
CreatedDep = Annotated[Mapping[str, datetime | None], Depends(_created)]
"""The query parameters `created_after` and `created_before`."""

_TIMES = frozenset({"created_at"})
_DIGEST_CHARACTERS = 12
_PARTS = 3
Shown = TypeVar("Shown", bound=BaseModel)
Row = TypeVar("Row")


class CursorError(SpinewatchError):
    """A cursor was not given by this list, or by the same list with other filters."""

    code = "invalid-cursor"


class Paging:
    """What page of which list a request asks for: ``wanted`` for the database, and the cursor of the next one.

    Parameters
    ----------
    limit, sort
        Largest number of items, and their order.
    cursor
        The cursor of the request, None for the first page.
    filters
        Everything else that decides which items the list has; a cursor holds for the same values only.
    """

    def __init__(self, limit: int, sort: str, cursor: str | None, **filters: Any) -> None:
        text = json.dumps([sort, filters], sort_keys=True, default=str)
        self._list = hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_CHARACTERS]
        after = None if cursor is None else self._position(cursor, sort.removeprefix("-") in _TIMES)
        self.wanted = PageRequest(limit, sort, after)

    def page_of(self, items: Sequence[Row], position: Callable[[Row], Position]) -> Page[Row]:
        """Return the page of a short list whose items are never removed; a cursor names the place of one of them."""
        after = self.wanted.after
        if after is not None and after not in map(position, items):
            raise _no_cursor()
        return page_of_items(items, position, self.wanted)

    def document(self, page: Page[Any], items: Sequence[Shown]) -> Mapping[str, Any]:
        """Return the fields of a ``Listing``."""
        following = None if page.next is None else self._cursor(page.next)
        return {"items": items, "total": page.total, "limit": self.wanted.limit, "next_cursor": following}

    def _cursor(self, position: Position) -> str:
        value = position.value
        text = value.isoformat() if isinstance(value, datetime) else value
        packed = json.dumps([self._list, text, position.id]).encode()
        return base64.urlsafe_b64encode(packed).decode().rstrip("=")

    def _position(self, cursor: str, is_time: bool) -> Position:
        try:
            made_for, position = _unpacked(cursor, is_time)
        except (ValueError, OverflowError, RecursionError) as error:
            raise _no_cursor() from error
        if made_for != self._list:
            raise _refused("the cursor belongs to another order or other filters; begin with the first page")
        if self._cursor(position) != cursor.rstrip("="):
            raise _no_cursor()
        return position


def _unpacked(cursor: str, is_time: bool) -> tuple[str, Position]:
    """Return of which list a cursor is and the place it names; raise ``ValueError`` for what no column can have."""
    packed = base64.b64decode(cursor + "=" * (-len(cursor) % 4), altchars=b"-_", validate=True)
    parts = json.loads(packed)
    if not isinstance(parts, list) or [type(part) for part in parts] != [str] * _PARTS:
        raise ValueError
    made_for, text, row = parts
    for part in (text, row):
        part.encode()  # a lone surrogate is no text
        if "\0" in part:
            raise ValueError
    if not is_time:
        return made_for, Position(text, row)
    time = datetime.fromisoformat(text)
    if time.utcoffset() != timedelta(0):
        raise ValueError
    return made_for, Position(time, row)


def _no_cursor() -> InvalidInputError:
    return _refused("this is not a cursor of this list; take next_cursor of the page before")


def _refused(sentence: str) -> InvalidInputError:
    return InvalidInputError("cursor", CursorError(sentence), part="query")
