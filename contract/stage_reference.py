"""The take of a stage that a result was derived from."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Identifier, Schema, StageName


class StageReference(Schema):
    """The take of a stage that a result was derived from."""

    name: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    calibration_id: Annotated[Identifier, Field(description="Identifier of the calibration.")]
