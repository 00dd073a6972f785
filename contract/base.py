"""What all schemas share: strictness, units, and the shapes of vectors, matrices, problems and pages."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Annotated, Any, Generic, TypeVar

from annotated_types import Len
from fastapi import Query
from pydantic import AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field

Item = TypeVar("Item")
_RFC_3339 = re.compile(r"\d{4}-\d\d-\d\d[Tt]\d\d:\d\d:\d\d(\.\d{1,6})?([Zz]|[+-]\d\d:\d\d)", re.ASCII)

Vector2 = Annotated[list[float], Len(2, 2)]
Vector3 = Annotated[list[float], Len(3, 3)]
Matrix3 = Annotated[list[Vector3], Len(3, 3)]
Matrix6 = Annotated[list[Annotated[list[float], Len(6, 6)]], Len(6, 6)]
Identifier = Annotated[str, Field(min_length=1, max_length=64)]
Timestamp = Annotated[AwareDatetime, Field(description="RFC 3339, UTC.", examples=["2026-11-21T09:30:00Z"])]


def _rfc_3339(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if not _RFC_3339.fullmatch(value):
        raise ValueError("not an RFC 3339 time with a zone; write it like 2026-11-21T09:30:00Z")
    try:
        return datetime.fromisoformat(value.upper()).astimezone(UTC)
    except OverflowError as error:
        raise ValueError("outside the years 1 to 9999") from error


TextTime = Annotated[datetime, BeforeValidator(_rfc_3339)]
"""A time in a form or a query, which comes as text."""
StageName = Annotated[
    str,
    Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
        description="Up to 64 letters, digits, dots, dashes and underscores.",
        examples=["PRE"],
    ),
]
Vertebra = Annotated[str, Field(pattern=r"^[CTLS][1-9][0-9]?$", examples=["T11"])]

Limit = Annotated[int, Query(ge=1, le=200, description="How many to return at most.")]
Offset = Annotated[int, Query(ge=0, le=2**31, description="How many to skip from the oldest.")]


class Schema(BaseModel):
    """Base of every document: nothing is converted, unknown fields and non-finite numbers are refused."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


class FieldError(Schema):
    """One doubt about a request."""

    loc: Annotated[list[str | int], Field(description="Where: body, path or query, then the field.")]
    msg: str
    type: str


class Problem(Schema):
    """What went wrong (RFC 9457)."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "type": "urn:spinewatch:problem:stage-exists",
                    "title": "Stage exists",
                    "status": 409,
                    "detail": "this surgery has a stage of that name already and its job is succeeded;"
                    " choose another name, or cancel a job that has not ended",
                    "instance": "urn:spinewatch:request:1c4d7f2e",
                }
            ]
        }
    )

    type: Annotated[str, Field(description="The kind of problem, for machines: docs/api.md lists them.")]
    title: str
    status: int
    detail: Annotated[str, Field(description="What is wrong and what to do, for people.")]
    instance: Annotated[str | None, Field(description="The request, as in X-Request-ID.")] = None
    errors: list[FieldError] | None = None


class Listing(Schema, Generic[Item]):
    """A page of a list, oldest first."""

    items: list[Item]
    total: Annotated[int, Field(description="How many there are in all pages.")]
    limit: int
    offset: int
