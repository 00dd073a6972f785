"""The audit: who did what, from where, with which outcome."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Schema, Timestamp
from contract.event import ActorKind, Outcome


class AuditEvent(Schema):
    """One event of the audit; its hash chains it to the one before."""

    seq: Annotated[int, Field(description="Number of the event; that of the next one is greater by one.")]
    at: Timestamp
    action: Annotated[
        str,
        Field(description="What was done, as kind of resource:verb.", examples=["stage:submitted"]),
    ]
    resource: Annotated[str, Field(description="Kind of the resource.", examples=["stage"])]
    subject_id: Annotated[str, Field(description="Identifier of the resource.")]
    surgery_id: Annotated[str | None, Field(description="The surgery that it belongs to; null for none.")]
    actor_kind: Annotated[ActorKind, Field(strict=False, description="Way in which the actor acted.")]
    actor_name: Annotated[
        str,
        Field(
            description="Prefix and name of the key, or the client's address; host and process of a worker; command."
        ),
    ]
    actor_key: Annotated[str | None, Field(description="Prefix of the key of an HTTP client.")]
    address: Annotated[str | None, Field(description="Address of an HTTP client.")]
    request_id: Annotated[str | None, Field(description="Identifier of the HTTP request.")]
    outcome: Annotated[Outcome, Field(strict=False, description="Whether it was done, refused, or failed.")]
    detail: Annotated[str | None, Field(description="What else is known of it.")]
    hash: Annotated[
        str, Field(description="SHA-256 of the hash before and this event, hexadecimal (docs/operations.md).")
    ]
