"""Checks of a calibration by the stages that were measured with it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Identifier, Schema, StageName, Timestamp
from contract.flag import Flag
from contract.page import Listing
from contract.stage import MarkerScale, RigCheck


class CalibrationCheck(Schema):
    """The check by one measured stage."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    taken_at: Annotated[Timestamp, Field(description="When it was captured, or else received.")]
    age_days: Annotated[
        float, Field(description="Age of the calibration then; negative when it was made afterwards.")
    ]
    drift: Annotated[RigCheck | None, Field(description="Null when there were too few balls.")]
    flags: Annotated[list[Flag], Field(description="The flags about the calibration.")]


class CalibrationChecks(Listing[CalibrationCheck]):
    """A page of the checks, and what all stages show together."""

    pooled_scale: Annotated[
        MarkerScale | None,
        Field(
            description="Scale of the markers over all stages of the calibration, whatever the page; null without any."
        ),
    ]


class ChecksSummary(Schema):
    """Number of stages measured with a calibration, and of those that question it; ``/checks`` has each."""

    stages: Annotated[int, Field(description="Number of stages measured with it.")]
    drifted: Annotated[int, Field(description="Number of stages in which the rig had moved.")]
    old: Annotated[int, Field(description="Number of stages that were taken when it was too old.")]
