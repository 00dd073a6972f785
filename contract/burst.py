"""Bursts: several stereo pairs of one stage, the movement between them, and what labels were decided by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field
from pydantic_core import to_jsonable_python

from contract.base import Number, Schema, StageName
from contract.flag import Flag
from contract.pose import PoseFields

if TYPE_CHECKING:
    import spinewatch.tracking.burst


class LabelSource(Schema):
    """The measurement whose distances and rotations decided on labels, because triads were missing."""

    stage: StageName
    take: Annotated[int, Field(ge=1, description="Its take.")]
    pair: Annotated[
        int | None,
        Field(
            ge=1, description="Number of the pair in the same burst; null for the result of an earlier stage."
        ),
    ] = None


class BurstPair(Schema):
    """What one pair of a burst shows."""

    offset_s: Annotated[
        Number | None, Field(description="Time since the first pair, s; null without times of exposure.")
    ]
    view_delay_s: Annotated[
        Number | None, Field(description="Time of the right exposure minus that of the left one, s.")
    ]
    poses: Annotated[dict[str, PoseFields], Field(description="Poses of the labelled triads by vertebra.")]
    outliers: Annotated[
        list[str], Field(description="Vertebrae whose pose is far from the other pairs and not in the mean.")
    ]
    labelled_by: Annotated[
        LabelSource | None, Field(description="What decided on the labels; null when the pair itself did.")
    ]
    flags: Annotated[list[Flag], Field(description="Doubts about this pair.")]


class BreathingMovement(Schema):
    """Breathing movement of a vertebra's triad, peak to peak."""

    amplitude_mm: Annotated[Number, Field(description="Movement in object space, peak to peak, mm.")]
    amplitude_sd_mm: Annotated[Number, Field(description="Its standard deviation, mm.")]
    relative_mm: Annotated[
        Number | None,
        Field(
            description="Movement as seen from the reference vertebra, peak to peak, mm; null for the reference itself."
        ),
    ]
    relative_sd_mm: Annotated[Number | None, Field(description="Its standard deviation, mm.")]


class Breathing(Schema):
    """Breathing in a burst: harmonics of one period that all vertebrae share."""

    period_s: Annotated[Number, Field(description="Period, s.")]
    period_sd_s: Annotated[Number, Field(description="Its standard deviation, s.")]
    harmonics: Annotated[int, Field(description="Number of harmonics that were fitted.")]
    reference: Annotated[str, Field(description="The reference vertebra of relative movement.")]
    movements: Annotated[dict[str, BreathingMovement], Field(description="Movement by vertebra.")]


class Burst(Schema):
    """How the poses of a stage follow from those of its pairs."""

    pairs: Annotated[list[BurstPair], Field(description="The pairs, in the order in which they were sent.")]
    breathing: Annotated[
        Breathing | None,
        Field(description="Null when no breathing was found, or the pairs do not determine it."),
    ]
    pairs_used: Annotated[dict[str, int], Field(description="Number of poses in the mean, by vertebra.")]
    shared_position_share: Annotated[
        Number,
        Field(
            description="Share of the stated covariances of positions that all pairs have in common, 0 to 1: it does"
            " not fall with the number of pairs."
        ),
    ]
    shared_rotation_share: Annotated[Number, Field(description="The same of rotations.")]
    parameters: Annotated[dict[str, Any], Field(description="Parameters of the combination, as they ran.")]

    @classmethod
    def of(
        cls,
        result: spinewatch.tracking.burst.BurstResult,
        pairs: list[BurstPair],
        reference: str,
        parameters: spinewatch.tracking.burst.BurstParameters,
    ) -> Burst:
        """Return the contract model of the library's result; ``pairs`` are those without outliers."""
        found = result.breathing
        breathing = None
        if found is not None:
            breathing = Breathing(
                period_s=found.period_s,
                period_sd_s=found.period_sd_s,
                harmonics=found.harmonics,
                reference=reference,
                movements={
                    label: BreathingMovement.model_validate(to_jsonable_python(movement))
                    for label, movement in found.movements.items()
                },
            )
        return cls(
            pairs=[
                pair.model_copy(update={"outliers": list(labels)})
                for pair, labels in zip(pairs, result.outliers, strict=True)
            ],
            breathing=breathing,
            pairs_used=dict(result.pairs_used),
            shared_position_share=result.shared_position_share,
            shared_rotation_share=result.shared_rotation_share,
            parameters=to_jsonable_python(parameters),
        )


class StageBurst(Schema):
    """The burst of a measured stage."""

    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    burst: Annotated[Burst | None, Field(description="Null for a stage of a single pair.")]
