"""Who a client is: a key, or a browser's session made from one."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Schema, Timestamp
from contract.key import KeyName, KeyPrefix, Scopes


class Identity(Schema):
    """The key that a request was made with, and what it permits."""

    key: KeyPrefix
    name: KeyName
    scopes: Scopes
    session: Annotated[bool, Field(description="Whether a cookie was sent instead of the key itself.")]
    expires_at: Annotated[
        Timestamp | None, Field(description="End of the session, or of the key; null if it stays valid.")
    ]
