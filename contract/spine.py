"""The spine at a stage: vertebrae, curves, measures, changes and attribution."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from contract.base import Identifier, Known, Known3, Matrix3, Schema, StageName, Vertebra, plain
from contract.flag import Flag
from contract.pose import FrameTransform, PoseFields, pose_fields
from contract.stage_reference import StageReference
from spinewatch.spine.configuration import InitialKind, Origin
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.results import MeasureStatus

if TYPE_CHECKING:
    import spinewatch.spine.assessment
    import spinewatch.spine.results
    import spinewatch.spine.target
    from spinewatch.spine.configuration import SpineConfiguration

_FIELDS = {
    definition: tuple(f"{quantity}{statistic}_{unit}" for statistic in ("", "_sd", "_interval"))
    for definition, quantity, unit in (
        ("coronal-tilt", "coronal_tilt", "deg"),
        ("sagittal-tilt", "sagittal_tilt", "deg"),
        ("axial-rotation", "axial_rotation", "deg"),
        ("lateral-displacement", "lateral_displacement", "mm"),
    )
}
"""Fields of a vertebra, for value, deviation and interval, by the definition that they are measured by."""

Sd = Annotated[Known, Field(description="Standard deviation.")]
Interval = Annotated[
    list[Known] | None, Field(description="Ends of the 95% interval; null when not measured.", max_length=2)
]


_DOUBT = (MeasureStatus.NOT_MEASURED, MeasureStatus.MEASURED, MeasureStatus.BRACKETED)
"""Which status several values have together: the last of theirs in this order."""

ORIGIN_REASON = "its centroid is the origin by definition"
"""Why the position of the reference vertebra is zero without an error."""

Names = Annotated[list[Vertebra], BeforeValidator(plain)]


class VertebraState(PoseFields):
    """One vertebra at one stage, in the frame of the spine."""

    vertebra: Annotated[Vertebra, Field(description="Name of the vertebra.")]
    origin: Annotated[Origin, Field(description="Where its pose comes from.")]
    marked: Annotated[bool, Field(description="Whether its triad has a pose in this stage and its baseline.")]
    coronal_tilt_deg: Annotated[
        Known, Field(description="Coronal tilt, degrees, positive with the left side up.")
    ]
    coronal_tilt_sd_deg: Sd
    sagittal_tilt_deg: Annotated[Known, Field(description="Sagittal tilt, degrees.")]
    sagittal_tilt_sd_deg: Sd
    axial_rotation_deg: Annotated[
        Known, Field(description="Axial rotation, degrees, positive with the anterior side turned left.")
    ]
    axial_rotation_sd_deg: Sd
    lateral_displacement_mm: Annotated[
        Known, Field(description="Displacement from the reference line, mm, positive to the right.")
    ] = None
    lateral_displacement_sd_mm: Sd = None
    coronal_tilt_interval_deg: Interval = None
    sagittal_tilt_interval_deg: Interval = None
    axial_rotation_interval_deg: Interval = None
    lateral_displacement_interval_mm: Interval = None
    status: Annotated[
        MeasureStatus | None,
        Field(
            description="How far tilts, axial rotation and displacement are determined; null in results of earlier"
            " versions."
        ),
    ] = None
    bracketed_reason: Annotated[str | None, Field(description="Why they are bracketed.")] = None
    position_reason: Annotated[
        str | None, Field(description="Why its position has no error: it is the origin.")
    ] = None
    not_measured_reason: Annotated[
        str | None, Field(description="Why one of them is not measured, although there is a pose.")
    ] = None

    @classmethod
    def of(
        cls, configuration: SpineConfiguration, measures: Iterable[spinewatch.spine.results.MeasureValue]
    ) -> list[VertebraState]:
        """Return the contract models of the vertebrae of a configuration, with the measures of each."""
        from spinewatch.triads.pose import Pose  # noqa: PLC0415 - only who computes with poses needs it

        measured: dict[str, dict[str, Any]] = {level: {} for level in configuration.levels}
        for value in measures:
            if value.definition in _FIELDS:
                numbers = (value.value, value.sd, _interval(value.lower, value.upper))
                fields = measured[value.levels[0]]
                fields |= dict(zip(_FIELDS[value.definition], numbers, strict=True))
                fields["status"] = max(value.status, fields.get("status", value.status), key=_DOUBT.index)
                if value.status is MeasureStatus.BRACKETED:
                    fields["bracketed_reason"] = value.reason
                elif value.status is MeasureStatus.NOT_MEASURED:
                    fields["not_measured_reason"] = value.reason
        unknown = dict.fromkeys(name for names in _FIELDS.values() for name in names)
        poses, covariances = configuration.poses, configuration.covariances()
        states = []
        for i, level in enumerate(configuration.levels):
            known = configuration.origins[i] is not Origin.NOT_MEASURED
            pose = Pose(poses.position_mm[i], poses.rotation[i], covariances[i]) if known else None
            states.append(
                cls(
                    **pose_fields(pose, configuration.reasons[i]),
                    vertebra=level,
                    origin=configuration.origins[i],
                    marked=bool(configuration.marked[i]),
                    position_reason=ORIGIN_REASON if level == configuration.origin else None,
                    **{**unknown, **measured[level]},
                )
            )
        return states


class Curve(Schema):
    """A curve of the spine in the coronal plane, as the baseline stage shows it."""

    name: Annotated[str, Field(description="Name of the curve.", examples=["curve 1"])]
    upper: Annotated[Vertebra, Field(description="Upper end vertebra.")]
    apex: Annotated[
        Vertebra | None,
        Field(
            description="Vertebra between the end vertebrae that is farthest from the line between them; null if none"
            " lies between."
        ),
    ]
    lower: Annotated[Vertebra, Field(description="Lower end vertebra.")]
    side: Annotated[
        str | None,
        Field(
            description="Side of the convexity: right or left; null where it is not known, because the 95% interval of"
            " the Cobb angle holds zero."
        ),
    ]
    open_ends: Annotated[
        Names,
        Field(description="End vertebrae at the end of the measured span: the curve may go on beyond."),
    ]

    @property
    def vertebrae(self) -> tuple[str, ...]:
        """The upper end vertebra, the apex if there is one, and the lower end vertebra."""
        return tuple(level for level in (self.upper, self.apex, self.lower) if level is not None)


class MeasureValue(Schema):
    """A measure of a stage, or its change between two stages."""

    definition: Annotated[
        str,
        Field(
            description="Identifier of the definition; docs/measures.md lists them.", examples=["cobb-fixed"]
        ),
    ]
    curve: Annotated[str | None, Field(description="The curve that it belongs to; null for the whole spine.")]
    levels: Annotated[Names, Field(description="Vertebrae that it is measured between, cranial first.")]
    unit: Annotated[str, Field(description="Unit of the value: deg or mm.", examples=["deg"])]
    value: Annotated[Known, Field(description="The value; null when not measured.")]
    sd: Sd
    interval: Interval
    status: Annotated[MeasureStatus, Field(description="How far it is determined.")]
    assumed: Annotated[bool, Field(description="Whether it depends on an assumed initial configuration.")]
    reason: Annotated[str | None, Field(description="Why it is bracketed or not measured.")]

    @classmethod
    def of(cls, measure: spinewatch.spine.results.MeasureValue) -> MeasureValue:
        """Return the contract model of the library's value, with the unit of its definition."""
        return cls(
            definition=measure.definition,
            curve=measure.curve,
            levels=list(measure.levels),
            unit=DEFINITIONS[measure.definition].unit,
            value=measure.value,
            sd=measure.sd,
            interval=_interval(measure.lower, measure.upper),
            status=measure.status,
            assumed=bool(measure.assumed),
            reason=measure.reason,
        )


class VertebraChange(Schema):
    """Motion of one vertebra between two stages, in the axes of the spine's frame."""

    vertebra: Annotated[Vertebra, Field(description="Name of the vertebra.")]
    origin: Annotated[Origin, Field(description="Where the motion comes from.")]
    reason: Annotated[str | None, Field(description="Why there is no motion.")]
    translation_mm: Annotated[Known3, Field(description="Displacement (anterior, left, cephalad), mm.")]
    translation_sd_mm: Annotated[Known3, Field(description="Its standard deviations, mm.")]
    rotation: Annotated[Matrix3 | None, Field(description="Rotation matrix; null without a motion.")]
    rotation_vector_deg: Annotated[
        Known3, Field(description="The same as axis times angle, about the patient's x, y and z, degrees.")
    ]
    rotation_sd_deg: Annotated[Known3, Field(description="Its standard deviations, degrees.")]
    angle_deg: Annotated[Known, Field(description="Angle of the rotation, degrees.")]
    angle_sd_deg: Sd
    angle_interval_deg: Annotated[
        list[Known] | None,
        Field(
            description="Ends of the 95% interval of the angle, degrees; never negative. Null without a motion and in"
            " results of earlier versions.",
            max_length=2,
        ),
    ] = None
    derotation_deg: Annotated[Known, Field(description="Rotation about the vertebra's own z axis, degrees.")]
    derotation_sd_deg: Sd
    coronal_deg: Annotated[Known, Field(description="Change of the coronal tilt, degrees.")]
    coronal_sd_deg: Sd
    sagittal_deg: Annotated[Known, Field(description="Change of the sagittal tilt, degrees.")]
    sagittal_sd_deg: Sd
    distraction_mm: Annotated[
        Known, Field(description="Change of the length of the curve from the reference vertebra, mm.")
    ]
    distraction_sd_mm: Sd

    @classmethod
    def of(cls, change: spinewatch.spine.results.VertebraChange) -> VertebraChange:
        """Return the contract model of the library's motion."""
        values = {name: getattr(change, name) for name in cls.model_fields.keys() - {"angle_interval_deg"}}
        values["angle_interval_deg"] = _interval(change.angle_lower_deg, change.angle_upper_deg)
        if not np.isfinite(change.rotation).all():
            values["rotation"] = None
        return cls.model_validate(values)


class Share(Schema):
    """A part of a change."""

    value: Annotated[Known, Field(description="The value; null when not measured.")]
    sd: Sd
    interval: Interval

    @classmethod
    def of(cls, share: spinewatch.spine.results.Share) -> Share:
        """Return the contract model of the library's part."""
        return cls(value=share.value, sd=share.sd, interval=_interval(share.lower, share.upper))


class Attribution(Schema):
    """How much of a correction came with rotation and how much with distraction."""

    subject: Annotated[str, Field(description="A curve, or a vertebra.", examples=["curve 1"])]
    quantity: Annotated[str, Field(description="Identifier of the definition of what is attributed.")]
    unit: Annotated[str, Field(description="Unit of the values: deg or mm.")]
    total: Annotated[Share, Field(description="The change.")]
    rotation: Annotated[Share, Field(description="The part that came with rotation.")]
    distraction: Annotated[Share, Field(description="The part that came with distraction.")]
    remainder: Annotated[
        Known,
        Field(description="What the two parts leave of the total; exactly zero for a displacement."),
    ]
    reason: Annotated[
        str | None,
        Field(description="Why the change is bracketed, and why it or its parts are not measured."),
    ]
    levels: Annotated[
        Names,
        Field(
            description="Vertebrae that the quantity is measured between, cranial first; empty in results of earlier"
            " versions."
        ),
    ] = Field(default_factory=list)
    status: Annotated[
        MeasureStatus | None,
        Field(
            description="How far the change is determined, and the parts that have a value; null in results of"
            " earlier versions."
        ),
    ] = None
    assumed: Annotated[
        bool | None,
        Field(
            description="Whether it depends on an assumed initial configuration; null in results of earlier versions."
        ),
    ] = None
    remainder_sd: Annotated[
        Known, Field(description="Standard deviation of the remainder; null in results of earlier versions.")
    ] = None
    remainder_interval: Interval = None

    @property
    def remainder_share(self) -> Share:
        """The remainder as a part of the change, with deviation and interval."""
        return Share(value=self.remainder, sd=self.remainder_sd, interval=self.remainder_interval)

    @classmethod
    def of(cls, attribution: spinewatch.spine.results.Attribution) -> Attribution:
        """Return the contract model of the library's attribution, with the unit of its quantity."""
        return cls(
            subject=attribution.subject,
            quantity=attribution.quantity,
            unit=DEFINITIONS[attribution.quantity].unit,
            total=Share.of(attribution.total),
            rotation=Share.of(attribution.rotation),
            distraction=Share.of(attribution.distraction),
            remainder=attribution.remainder.value,
            remainder_sd=attribution.remainder.sd,
            remainder_interval=_interval(attribution.remainder.lower, attribution.remainder.upper),
            reason=attribution.reason,
            levels=list(attribution.levels),
            status=attribution.status,
            assumed=bool(attribution.assumed),
        )


class SpineChange(Schema):
    """What happened between an earlier stage and this one."""

    since: Annotated[StageReference, Field(description="The earlier stage.")]
    vertebrae: Annotated[list[VertebraChange], Field(description="Motion of each vertebra, cranial first.")]
    measures: Annotated[
        list[MeasureValue], Field(description="Changes of measures: the later value less the earlier one.")
    ]
    attribution: Annotated[list[Attribution], Field(description="Attribution per curve and per vertebra.")]

    @field_validator("attribution")
    @classmethod
    def _qualified(cls, attribution: list[Attribution], info: ValidationInfo) -> list[Attribution]:
        """Add to the attributions of earlier versions what qualifies the changes that they divide."""
        vertebrae, measures = info.data.get("vertebrae", []), info.data.get("measures", [])
        return [_qualified(part, vertebrae, measures) for part in attribution]

    @classmethod
    def of(cls, change: spinewatch.spine.results.SpineChange, since: StageReference) -> SpineChange:
        """Return the contract model of the library's change since a stage."""
        return cls(
            since=since,
            vertebrae=[VertebraChange.of(vertebra) for vertebra in change.vertebrae],
            measures=[MeasureValue.of(measure) for measure in change.measures],
            attribution=[Attribution.of(attribution) for attribution in change.attribution],
        )


class RemainingCorrection(Schema):
    """What remains to the planned configuration: the plan less what is."""

    vertebra: Annotated[Vertebra, Field(description="Name of the vertebra.")]
    coronal_deg: Annotated[Known, Field(description="Coronal tilt, degrees.")]
    sagittal_deg: Annotated[Known, Field(description="Sagittal tilt, degrees.")]
    axial_deg: Annotated[Known, Field(description="Axial rotation, degrees.")]
    sd_deg: Annotated[Known3, Field(description="Standard deviations of the three, degrees.")]
    translation_mm: Annotated[
        Known3, Field(description="Translation, patient axes, mm; null where not planned.")
    ]
    translation_sd_mm: Annotated[Known3, Field(description="Standard deviations of the translation, mm.")]

    @classmethod
    def of(cls, remaining: spinewatch.spine.target.RemainingMotion) -> RemainingCorrection:
        """Return the contract model of the library's remaining motion."""
        coronal, sagittal, axial = remaining.angles_deg
        return cls(
            vertebra=remaining.vertebra,
            coronal_deg=coronal,
            sagittal_deg=sagittal,
            axial_deg=axial,
            sd_deg=plain(remaining.angles_sd_deg),
            translation_mm=plain(remaining.translation_mm),
            translation_sd_mm=plain(remaining.translation_sd_mm),
        )


class StageSpine(Schema):
    """The configuration of the spine at a stage, and what changed since earlier ones."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    setup_revision: Annotated[int, Field(description="Revision of the setup that it was computed with.")]
    frame: Annotated[
        str,
        Field(
            description="Name of the coordinate system.",
            examples=["patient axes at stage PRE, fixed to L1; origin at its centroid at PRE"],
        ),
    ]
    object_to_spine: Annotated[
        FrameTransform | None,
        Field(
            description="From object space of this stage, which its triads are in, to the frame of the spine; null in"
            " results of earlier versions."
        ),
    ] = None
    reference_vertebra: Annotated[Vertebra, Field(description="The vertebra that the frame is fixed to.")]
    reference_line: Annotated[str, Field(description="The line that lateral translations are measured from.")]
    initial: Annotated[InitialKind, Field(description="How the initial configuration became known.")]
    baseline: Annotated[StageReference, Field(description="The stage of the initial configuration.")]
    vertebrae: Annotated[list[VertebraState], Field(description="Every vertebra, cranial first.")]
    curves: Annotated[list[Curve], Field(description="Curves of the baseline stage, cranial first.")]
    measures: Annotated[list[MeasureValue], Field(description="Measures of this stage.")]
    since_baseline: Annotated[
        SpineChange | None, Field(description="Change since the baseline stage; null for that stage itself.")
    ]
    since_previous: Annotated[
        SpineChange | None, Field(description="Change since the stage before; null for the first one.")
    ]
    remaining: Annotated[
        list[RemainingCorrection] | None, Field(description="What remains to the target; null without one.")
    ]
    target_measures: Annotated[
        list[MeasureValue] | None,
        Field(description="Measures of the target less those of this stage; null without a target."),
    ]
    flags: Annotated[list[Flag], Field(description="Doubts about the configuration.")]
    parameters: Annotated[dict[str, Any], Field(description="All parameters of the method, as they ran.")]
    version: Annotated[str, Field(description="Version of Spinewatch that computed it.")]

    @classmethod
    def of(
        cls,
        assessment: spinewatch.spine.assessment.StageAssessment,
        kind: InitialKind,
        baseline: StageReference,
        previous: StageReference | None,
        reference_vertebra: str,
        **identity: Any,
    ) -> StageSpine:
        """Return the contract model of the library's assessment.

        ``identity`` has the fields that say which stage it is of: ``surgery_id``, ``stage``, ``take`` and so on.
        """
        since_baseline, since_previous = assessment.since_baseline, assessment.since_previous
        remaining, target_measures = assessment.remaining, assessment.target_measures
        return cls(
            frame=spine_frame(baseline.name, reference_vertebra),
            reference_vertebra=reference_vertebra,
            object_to_spine=FrameTransform.model_validate(assessment.object_to_spine),
            reference_line=f"line along the patient's z axis through the centroid of {reference_vertebra} at"
            f" {baseline.name}",
            initial=kind,
            baseline=baseline,
            vertebrae=VertebraState.of(assessment.configuration, assessment.vertebrae),
            curves=[Curve.model_validate(curve) for curve in assessment.measured.curves],
            measures=[MeasureValue.of(measure) for measure in assessment.measured.measures],
            since_baseline=None if since_baseline is None else SpineChange.of(since_baseline, baseline),
            since_previous=None
            if since_previous is None or previous is None
            else SpineChange.of(since_previous, previous),
            remaining=None if remaining is None else [RemainingCorrection.of(item) for item in remaining],
            target_measures=None
            if target_measures is None
            else [MeasureValue.of(measure) for measure in target_measures],
            **identity,
        )


def spine_frame(baseline: str, reference_vertebra: str) -> str:
    """Return the name of the coordinate system of a spine."""
    return f"patient axes at stage {baseline}, fixed to {reference_vertebra}; origin at its centroid at {baseline}"


def _qualified(
    part: Attribution, vertebrae: Iterable[VertebraChange], measures: Iterable[MeasureValue]
) -> Attribution:
    """Return an attribution with the vertebrae and the status of its change: a measure's, or a vertebra's."""
    if part.status is not None:
        return part
    measures = list(measures)
    own = [m for m in measures if (m.curve, m.definition) == (part.subject, part.quantity)]
    if own:
        levels, status = own[0].levels, own[0].status
    else:
        origins = [moved.origin for moved in vertebrae if moved.vertebra == part.subject]
        levels = [part.subject] if origins else []
        status = MeasureStatus.MEASURED if origins == [Origin.MEASURED] else MeasureStatus.BRACKETED
    if part.total.value is None:
        status = MeasureStatus.NOT_MEASURED
    assumed = any(measure.assumed for measure in measures)
    return part.model_copy(update={"levels": levels, "status": status, "assumed": assumed})


def _interval(lower: float, upper: float) -> list[float | None] | None:
    """Return the ends of an interval, None for one that is not determined."""
    return [float(lower), float(upper)] if math.isfinite(lower) and math.isfinite(upper) else None
