"""The measures of a stage, their changes and what remains: the spine of a stage without its vertebrae."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Identifier, Schema, StageName, Vertebra
from contract.flag import Flag
from contract.spine import Attribution, Curve, MeasureValue, RemainingCorrection, SpineChange, StageSpine
from contract.stage_reference import StageReference


class MeasureChange(Schema):
    """How the measures changed since an earlier stage."""

    since: Annotated[StageReference, Field(description="The earlier stage.")]
    measures: Annotated[
        list[MeasureValue], Field(description="Changes of measures: the later value less the earlier one.")
    ]
    attribution: Annotated[list[Attribution], Field(description="Attribution per curve and per vertebra.")]


class StageMeasures(Schema):
    """The measures of a stage."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    setup_revision: Annotated[int, Field(description="Revision of the setup that they were computed with.")]
    reference_vertebra: Annotated[Vertebra, Field(description="The vertebra that the frame is fixed to.")]
    reference_line: Annotated[str, Field(description="The line that lateral translations are measured from.")]
    curves: Annotated[list[Curve], Field(description="Curves of the baseline stage, cranial first.")]
    measures: Annotated[list[MeasureValue], Field(description="Measures of this stage.")]
    since_baseline: Annotated[
        MeasureChange | None,
        Field(description="Change since the baseline stage; null for that stage itself."),
    ]
    since_previous: Annotated[
        MeasureChange | None, Field(description="Change since the stage before; null for the first one.")
    ]
    remaining: Annotated[
        list[RemainingCorrection] | None, Field(description="What remains to the target; null without one.")
    ]
    target_measures: Annotated[
        list[MeasureValue] | None,
        Field(description="Measures of the target less those of this stage; null without a target."),
    ]
    flags: Annotated[list[Flag], Field(description="Doubts about the configuration.")]
    version: Annotated[str, Field(description="Version of Spinewatch that computed them.")]

    @classmethod
    def of(cls, spine: StageSpine) -> StageMeasures:
        """Return the measures of the spine of a stage."""
        values = {name: getattr(spine, name) for name in cls.model_fields}
        changes = {name: _change(values[name]) for name in ("since_baseline", "since_previous")}
        return cls(**{**values, **changes})


def _change(change: SpineChange | None) -> MeasureChange | None:
    return None if change is None else MeasureChange.model_validate(change)
