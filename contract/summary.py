"""A surgery with all its stages and spines in one document: what a dashboard, a report and an export need."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Identifier, Schema, StageName, Timestamp, Vertebra
from contract.flag import Flag
from contract.image import ImagePair
from contract.job import JobState
from contract.spine import StageSpine
from contract.spine_setup import StoredSpineSetup
from contract.triad import Triad

SPINE_NOT_COMPUTED = "the spine is not computed yet"
"""Reason of a stage whose spine a job will compute."""


class SummaryStage(Schema):
    """The take of a stage whose results count, with them: the latest measured one, or else the latest."""

    name: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    calibration_id: Annotated[Identifier, Field(description="Identifier of the calibration.")]
    state: Annotated[JobState, Field(description="State of the job that measures it.")]
    captured_at: Annotated[Timestamp | None, Field(description="Time of capture as sent; null when unknown.")]
    created_at: Timestamp
    images: Annotated[ImagePair, Field(description="The two images, with their SHA-256.")]
    triads: Annotated[list[Triad] | None, Field(description="The triads; null before the job has succeeded.")]
    flags: Annotated[list[Flag] | None, Field(description="Doubts about the triads.")]
    version: Annotated[str | None, Field(description="Version of Spinewatch that measured it.")]
    spine: Annotated[StageSpine | None, Field(description="The spine; null while there is none.")]
    spine_reason: Annotated[str | None, Field(description="Why there is no spine.")]


class SurgerySummary(Schema):
    """A surgery with all its stages."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    reference: Annotated[str, Field(description="The hospital's own case number.")]
    vertebrae: Annotated[list[Vertebra], Field(description="Vertebrae with a marker.")]
    reference_vertebra: Annotated[Vertebra, Field(description="Vertebra of the reference triad.")]
    created_at: Timestamp
    setup: Annotated[StoredSpineSetup | None, Field(description="Setup of the spine; null without one.")]
    stages: Annotated[
        list[SummaryStage], Field(description="Each stage by the take whose results count, in order.")
    ]
    version: Annotated[str, Field(description="Version of Spinewatch that wrote this document.")]
