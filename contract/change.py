"""Changes: what happened to the contents of the database, in order."""

from __future__ import annotations

from typing import Annotated

from pydantic import ConfigDict, Field

from contract.base import Identifier, Schema, StageName, Timestamp


class Change(Schema):
    """One change of the contents of the database."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "seq": 117,
                    "at": "2026-11-21T09:30:00Z",
                    "kind": "stage",
                    "action": "stage:measured",
                    "id": "0b7c1c5e-3b1f-4a6e-9a53-0a3d1d1d3f52",
                    "surgery_id": "5f0c86c4-5c58-4cb0-a8a6-6d3f4e9b7a11",
                    "stage": "PRE",
                    "take": 1,
                }
            ]
        }
    )

    seq: Annotated[
        int,
        Field(description="Number of the change; later commits have larger ones, some numbers are left out."),
    ]
    at: Timestamp
    kind: Annotated[
        str,
        Field(
            description="What was changed: surgery, stage, calibration, radiograph, spine or job.",
            examples=["stage"],
        ),
    ]
    action: Annotated[str, Field(description="What happened, as subject:verb.", examples=["stage:measured"])]
    id: Annotated[Identifier, Field(description="Identifier of what was changed.")]
    surgery_id: Annotated[Identifier | None, Field(description="Null for what belongs to no surgery.")]
    stage: Annotated[StageName | None, Field(description="Name of the stage, null for other kinds.")]
    take: Annotated[int | None, Field(description="Take of the stage, null for other kinds.")]


class Changes(Schema):
    """Changes after a number, oldest first."""

    changes: Annotated[list[Change], Field(description="The changes, oldest first.")]
    last: Annotated[
        int,
        Field(
            description="What to ask for next as `since`: no change up to this number is still to be delivered."
        ),
    ]
    done: Annotated[bool, Field(description="Whether there are no more changes for now.")]
