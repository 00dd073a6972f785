"""Problem documents: why a request or a job failed (RFC 9457)."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field

from contract.base import Schema


class FieldError(Schema):
    """One field of a request that cannot be used."""

    loc: Annotated[
        list[str | int], Field(description="Position: body, path or query, then the path of the field.")
    ]
    msg: Annotated[str, Field(description="What is wrong, for people.")]
    type: Annotated[str, Field(description="The kind of error, for machines.")]


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

    type: Annotated[str, Field(description="The kind of problem, for machines; docs/api.md lists them.")]
    title: Annotated[str, Field(description="The kind of problem, for people.")]
    status: Annotated[int, Field(description="HTTP status.")]
    detail: Annotated[str, Field(description="What is wrong and what to do, for people.")]
    instance: Annotated[str | None, Field(description="The request, as in X-Request-ID.")] = None
    errors: Annotated[list[FieldError] | None, Field(description="The fields that cannot be used.")] = None

    def members(self) -> dict[str, Any]:
        """Return the members as JSON values, without those of the problem itself that are null."""
        return {name: value for name, value in self.model_dump(mode="json").items() if value is not None}
