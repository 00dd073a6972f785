"""API keys: who may do what over HTTP; the secret of a key is shown once, when it is made."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from contract.base import Schema, Timestamp


class Scope(StrEnum):
    """What a key permits; ``admin`` includes the others."""

    CAPTURE_WRITE = "capture:write"
    STAGE_READ = "stage:read"
    CORRECT_WRITE = "correct:write"
    ADMIN = "admin"


KeyPrefix = Annotated[
    str,
    Field(
        pattern=r"^[a-z2-7]{8}$",
        description="Visible part of the key, which names it in lists and in the audit.",
        examples=["k3vq7mzd"],
    ),
]
KeyName = Annotated[
    str,
    Field(
        pattern=r"^[A-Za-z0-9]([A-Za-z0-9 ._-]{0,62}[A-Za-z0-9])?$",
        description="What the key is for: up to 64 letters, digits, spaces, dots, dashes and underscores.",
        examples=["cart 1"],
    ),
]
Scopes = Annotated[
    list[Annotated[Scope, Field(strict=False)]],
    Field(
        min_length=1,
        max_length=len(Scope),
        json_schema_extra={"uniqueItems": True},
        description="What the key permits: capture:write (rigs, surgeries, stages, radiographs), stage:read (results),"
        " correct:write (setups, corrections), admin (all of it, and keys).",
        examples=[["capture:write", "stage:read"]],
    ),
]
_Expiry = Annotated[Timestamp | None, Field(description="Time after which it is refused; null for never.")]


class NewKey(Schema):
    """A key to make."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {"name": "cart 1", "scopes": ["capture:write", "stage:read"], "expires_in_days": 365}
            ]
        }
    )

    name: KeyName
    scopes: Scopes
    expires_in_days: Annotated[
        int | None,
        Field(ge=1, le=3650, description="Days until the key is refused; null for a key that stays valid."),
    ] = None

    @model_validator(mode="after")
    def _each_once(self) -> Self:
        if len(set(self.scopes)) < len(self.scopes):
            raise ValueError("a scope is named twice; name each once")
        return self


class Key(Schema):
    """A key without its secret."""

    prefix: KeyPrefix
    name: KeyName
    scopes: Scopes
    created_at: Timestamp
    expires_at: _Expiry
    revoked_at: Annotated[
        Timestamp | None, Field(description="Time since which it is refused; null if it is not.")
    ]
    last_used_at: Annotated[
        Timestamp | None,
        Field(description="Time of its last use, to about a minute; null if it was never used."),
    ]


class CreatedKey(Key):
    """A new key with its secret, which is not stored and cannot be shown again."""

    key: Annotated[
        str,
        Field(
            description="The whole key, for the header Authorization: Bearer; keep it, it is shown only here."
        ),
    ]
