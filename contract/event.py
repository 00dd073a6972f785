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


class Actor(Schema):
    """Who acts: an HTTP client, a worker process or a command."""

    kind: ActorKind
    name: Annotated[
        str,
        Field(max_length=128, description="Address of the client, host and process of the worker, command."),
    ]
