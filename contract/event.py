"""Events: who did what in the database."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from contract.base import Schema


class ActorKind(StrEnum):
    """Way in which an actor acts."""

    HTTP = "http"
    WORKER = "worker"
    COMMAND = "command"


class Outcome(StrEnum):
    """How an action ended."""

    SUCCESS = "success"
    REFUSED = "refused"
    FAILED = "failed"


class Actor(Schema):
    """Who acts: an HTTP client, a worker process or a command."""

    kind: ActorKind
    name: Annotated[
        str,
        Field(
            max_length=128,
            description="Prefix and name of the key (or the address of a client without one), host and process of the"
            " worker, command.",
        ),
    ]
    key: Annotated[str | None, Field(max_length=16, description="Prefix of the key of an HTTP client.")] = (
        None
    )
    address: Annotated[str | None, Field(max_length=64, description="Address of an HTTP client.")] = None
    request_id: Annotated[
        str | None, Field(max_length=64, description="Identifier of the HTTP request, as in X-Request-ID.")
    ] = None
