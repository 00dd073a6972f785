"""Surgeries: the operations that stages belong to."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from fastapi import APIRouter, Depends, Response
from pydantic import ConfigDict, Field, model_validator

from contract.base import Identifier, Limit, Listing, Offset, Schema, StageName, Timestamp, Vertebra
from service.dependencies import TheDatabase, json_body, problems
from store import surgeries
from store.clock import utc_now
from store.tables import JobState, Stage, Surgery

router = APIRouter(prefix="/v1/surgeries", tags=["surgeries"])

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
        Field(min_length=1, max_length=30, description="Marked vertebrae, by rising coordinate on the axis."),
    ]
    reference_vertebra: Annotated[Vertebra, Field(description="The one in whose frame motion is given.")]
    spine_axis: Annotated[SpineAxis, Field(description="Object-space axis along which the spine lies.")] = (
        "auto"
    )

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        if len(set(self.vertebrae)) < len(self.vertebrae):
            raise ValueError("vertebrae names one twice; name each once")
        if self.reference_vertebra not in self.vertebrae:
            raise ValueError("reference_vertebra is not among vertebrae; choose a marked one")
        return self


class StageSummary(Schema):
    """One take of a stage in short."""

    name: StageName
    take: int
    state: JobState
    job_id: Identifier
    captured_at: Timestamp | None
    created_at: Timestamp

    @classmethod
    def of(cls, stage: Stage) -> StageSummary:
        """Return the summary of a row."""
        return cls(
            name=stage.name,
            take=stage.take,
            state=stage.job.state,
            job_id=stage.job.id,
            captured_at=stage.captured_at,
            created_at=stage.created_at,
        )


class SurgeryDocument(Schema):
    """A surgery in the record, with every take of its stages."""

    id: Identifier
    reference: str
    vertebrae: list[Vertebra]
    reference_vertebra: Vertebra
    spine_axis: SpineAxis
    created_at: Timestamp
    stages: Annotated[list[StageSummary], Field(description="Every take, oldest first.")]

    @classmethod
    def of(cls, row: Surgery) -> SurgeryDocument:
        """Return the document of a row."""
        return cls.model_validate(
            {
                "id": row.id,
                "reference": row.reference,
                "vertebrae": row.vertebrae,
                "reference_vertebra": row.reference_vertebra,
                "spine_axis": row.spine_axis,
                "created_at": row.created_at,
                "stages": [StageSummary.of(stage) for stage in row.stages],
            }
        )


@router.post("", status_code=201, dependencies=[Depends(json_body)], responses=problems(413, 415, 422))
def create_surgery(new: NewSurgery, record: TheDatabase, response: Response) -> SurgeryDocument:
    """Add a surgery."""
    with record.writing() as session:
        row = surgeries.add(session, surgeries.NewSurgery(**new.model_dump()), utc_now())
    response.headers["Location"] = f"{router.prefix}/{row.id}"
    return SurgeryDocument.of(row)


@router.get("", responses=problems(422))
def list_surgeries(record: TheDatabase, limit: Limit = 50, offset: Offset = 0) -> Listing[SurgeryDocument]:
    """List the surgeries, oldest first."""
    with record.reading() as session:
        page = surgeries.listed(session, limit, offset)
    items = [SurgeryDocument.of(row) for row in page.items]
    return Listing(items=items, total=page.total, limit=limit, offset=offset)


@router.get("/{surgery_id}", responses=problems(404))
def get_surgery(surgery_id: str, record: TheDatabase) -> SurgeryDocument:
    """Show a surgery with the state of its stages."""
    with record.reading() as session:
        return SurgeryDocument.of(surgeries.get_with_stages(session, surgery_id))
