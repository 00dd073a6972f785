"""Surgeries: the operations that stages belong to."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from contract.base import Identifier, Schema, StageName, Timestamp, Vertebra
from contract.job import JobState
from contract.text import visible
from spinewatch.levels import canonical_name, extra_level_names, vertebra_names

SpineAxis = Literal["x", "y", "auto"]
VertebraName = Annotated[
    str,
    Field(
        min_length=1,
        max_length=16,
        pattern=r"\S",
        description="Vertebra of C1-C7, T1-T12, L1-L5 and S1, or a declared extra level; l1 and T09 are stored as L1"
        " and T9.",
        examples=["T11"],
    ),
    AfterValidator(canonical_name),
]


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
                    "extra_levels": [],
                }
            ]
        }
    )

    reference: Annotated[
        str,
        Field(
            min_length=1,
            max_length=64,
            description="The hospital's own case number; never a name. Numbers, with letters between them or one short"
            " word before them, unless the site has set another pattern.",
        ),
        AfterValidator(visible),
    ]
    vertebrae: Annotated[
        list[VertebraName],
        Field(
            min_length=1,
            max_length=30,
            description="Vertebrae with a marker, in order of increasing coordinate along the axis: in anatomical"
            " order, downwards or upwards.",
        ),
    ]
    reference_vertebra: Annotated[
        VertebraName, Field(description="The vertebra in whose frame motion is given.")
    ]
    spine_axis: Annotated[SpineAxis, Field(description="Object-space axis along which the spine lies.")] = (
        "auto"
    )
    extra_levels: list[VertebraName] = Field(
        default_factory=list,
        max_length=6,
        description="Vertebrae that this spine has in addition to the usual ones, each once: T13, L6, S2 to S5.",
    )

    @model_validator(mode="after")
    def _in_anatomical_order(self) -> Self:
        vertebra_names(self.vertebrae, extra_level_names(self.extra_levels))
        if self.reference_vertebra not in self.vertebrae:
            raise ValueError("reference_vertebra is not among vertebrae; give a marked one")
        return self


class StageSummary(Schema):
    """One take of a stage in short."""

    name: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    state: Annotated[JobState, Field(description="State of the job that measures it.")]
    job_id: Annotated[Identifier, Field(description="Identifier of that job.")]
    captured_at: Annotated[Timestamp | None, Field(description="Time of capture as sent; null when unknown.")]
    created_at: Timestamp


class Surgery(Schema):
    """A surgery with every take of its stages."""

    id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    reference: Annotated[str, Field(description="The hospital's own case number.")]
    vertebrae: Annotated[
        list[Vertebra], Field(description="Vertebrae with a marker, by increasing coordinate.")
    ]
    reference_vertebra: Annotated[Vertebra, Field(description="The vertebra in whose frame motion is given.")]
    spine_axis: Annotated[SpineAxis, Field(description="Object-space axis along which the spine lies.")]
    extra_levels: Annotated[
        list[Vertebra], Field(description="Declared vertebrae in addition to the usual ones.")
    ]
    created_at: Timestamp
    stages: Annotated[list[StageSummary], Field(description="Every take, oldest first.")]
