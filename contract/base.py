"""The base of every contract model, and the types of their fields."""

from __future__ import annotations

import math
from typing import Annotated, Any

from annotated_types import Len
from pydantic import AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field


class Schema(BaseModel):
    """Base of every contract model: nothing is converted, unknown fields and non-finite numbers are refused."""

    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True, from_attributes=True
    )


def plain(value: Any) -> Any:
    """Return an array, a NumPy number or a tuple as a list or a Python number; anything else as it is."""
    if isinstance(value, tuple):
        return list(value)
    tolist = getattr(value, "tolist", None)
    return value if tolist is None else tolist()


def _known(value: Any) -> Any:
    number = plain(value)
    return None if isinstance(number, float) and not math.isfinite(number) else number


Plain = BeforeValidator(plain)
"""Validator that accepts what the library holds as arrays, NumPy numbers and tuples."""

Number = Annotated[float, Plain]
Known = Annotated[float | None, BeforeValidator(_known)]
"""A number that is null when it is not determined (NaN or infinite in the library)."""

Vector2 = Annotated[list[float], Len(2, 2), Plain]
Vector3 = Annotated[list[float], Len(3, 3), Plain]
Known2 = Annotated[list[Known], Len(2, 2), Plain]
Known3 = Annotated[list[Known], Len(3, 3), Plain]
Matrix3 = Annotated[list[Vector3], Len(3, 3), Plain]
Matrix6 = Annotated[list[Annotated[list[float], Len(6, 6)]], Len(6, 6), Plain]

Identifier = Annotated[str, Field(min_length=1, max_length=64)]
Timestamp = Annotated[AwareDatetime, Field(description="RFC 3339, UTC.", examples=["2026-11-21T09:30:00Z"])]
StageName = Annotated[
    str,
    Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$",
        description="Up to 64 letters, digits, dots, dashes and underscores.",
        examples=["PRE"],
    ),
]
Vertebra = Annotated[str, Field(pattern=r"^[CTLS][1-9][0-9]?$", examples=["T11"])]
"""A vertebra in canonical spelling; records of earlier versions may hold one that no spine has, such as L9."""
