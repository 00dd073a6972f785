"""Jobs: work that a worker does for a subject."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from contract.base import Identifier, Schema, StageName, Timestamp
from contract.problem import Problem


class JobState(StrEnum):
    """State of a job; the last three are final."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


FINAL_STATES = frozenset({JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED})


class Job(Schema):
    """Work that a worker does: a measurement of one take of a stage, a calibration from images, and so on."""

    id: Annotated[Identifier, Field(description="Identifier of the job.")]
    kind: Annotated[str, Field(description="Kind of work.", examples=["stage", "calibration"])]
    surgery_id: Annotated[Identifier | None, Field(description="Null for work outside a surgery.")]
    stage: Annotated[StageName | None, Field(description="The stage that is measured, null for other kinds.")]
    take: Annotated[int | None, Field(description="The take that is measured, null for other kinds.")]
    calibration_id: Annotated[
        Identifier | None, Field(description="The calibration that was made, once the job has succeeded.")
    ]
    state: Annotated[JobState, Field(description="State of the job.")]
    progress: Annotated[float, Field(ge=0, le=1, description="Fraction of the work that is done.")]
    step: Annotated[str | None, Field(description="The current step.", examples=["detect"])]
    attempts: Annotated[
        int, Field(description="Number of attempts, without those whose worker ended or was stopped.")
    ]
    error: Annotated[Problem | None, Field(description="Why it failed.")]
    created_at: Timestamp
    started_at: Annotated[Timestamp | None, Field(description="Start of the first attempt; null before.")]
    finished_at: Annotated[Timestamp | None, Field(description="End of the job; null before.")]
