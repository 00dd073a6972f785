"""Surgeries: the operations that stages belong to."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from contract.base import Identifier, Schema, StageName, Timestamp, Vertebra
from contract.job import JobState

SpineAxis = Literal["x", "y", "auto"]


class NewSurgery(Schema):
    """What is known of a surgery before its first stage."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "reference": "2026-0417",
                    "vertebrae": ["L1", "T11", "T9", "T7"],
                    "reference_vertebra": "L1",
                    "spine_axis": "x",
                }
            ]
        }
    )

    reference: Annotated[
        str,
        Field(min_length=1, max_length=100, description="The hospital's own case number; never a name."),
    ]
    vertebrae: Annotated[
        list[Vertebra],
        Field(
            min_length=1,
            max_length=30,
            description="Vertebrae with a marker, in order of increasing coordinate along the axis.",
        ),
    ]
    reference_vertebra: Annotated[Vertebra, Field(description="The vertebra in whose frame motion is given.")]
    spine_axis: Annotated[SpineAxis, Field(description="Object-space axis along which the spine lies.")] = (
        "auto"
    )

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        if len(set(self.vertebrae)) < len(self.vertebrae):
            raise ValueError("vertebrae names one twice; name each once")
        if self.reference_vertebra not in self.vertebrae:
            raise ValueError("reference_vertebra is not among vertebrae; give a marked one")
        return self


class StageSummary(Schema):
    """One take of a stage in short."""

    name: StageName
    take: int
    state: JobState
    job_id: Identifier
    captured_at: Timestamp | None
    created_at: Timestamp


class Surgery(Schema):
    """A surgery with every take of its stages."""

    id: Identifier
    reference: str
    vertebrae: list[Vertebra]
    reference_vertebra: Vertebra
    spine_axis: SpineAxis
    created_at: Timestamp
    stages: Annotated[list[StageSummary], Field(description="Every take, oldest first.")]
