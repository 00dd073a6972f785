"""Stages of a surgery: what is measured in a stereo pair, and how a stage is shown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field
from pydantic_core import to_jsonable_python

from contract.base import Identifier, Number, Schema, StageName, Timestamp, Vector3
from contract.burst import Burst, LabelSource
from contract.features import ExposurePair, FeaturePair, FieldPair
from contract.flag import Flag
from contract.image import ImagePair
from contract.job import Job, JobState
from contract.measuring import Measuring
from contract.revision import RemovedTriad, Revision
from contract.triad import Triad

if TYPE_CHECKING:
    import spinewatch.matching.rig_check
    import spinewatch.stage


class MarkerScale(Schema):
    """Measured over known distances between the balls of the markers.

    A rotation of a camera about the vertical of its image and a changed base alter it; no number of balls shows them on
    the epipolar lines.
    """

    distances: Annotated[int, Field(description="Number of distances.")]
    scale: Annotated[Number, Field(description="Measured over known size; 1 without a drift.")]
    sd: Annotated[Number, Field(description="Its standard deviation from the centres of the ball images.")]
    common_sd: Annotated[
        Number,
        Field(
            description="Its standard deviation from the manufacture of the markers and from the calibration: the same"
            " in all stages of a calibration."
        ),
    ]
    p_value: Annotated[Number, Field(description="Probability of such a deviation from 1 without a drift.")]
    drifted: Annotated[bool, Field(description="Whether the rig, or a marker, is not the configured one.")]
    yaw_deg: Annotated[
        Number,
        Field(description="Rotation of the right camera about y that alone would explain it, degrees."),
    ]
    base_mm: Annotated[Number, Field(description="Change of the base that alone would explain it, mm.")]


class RigCheck(Schema):
    """The calibration checked by the balls of a stage: the estimated motion of the right camera."""

    balls: Annotated[int, Field(description="Number of balls visible in both images.")]
    rms_px: Annotated[Number, Field(description="RMS distance from epipolar lines in the right image, px.")]
    p_value: Annotated[Number, Field(description="Probability of residuals like these without a motion.")]
    drifted: Annotated[
        bool,
        Field(description="Whether the rig has moved since its calibration, by the lines or by the scale."),
    ]
    rotation_deg: Annotated[Vector3, Field(description="Rotation about the right camera's axes, degrees.")]
    rotation_sd_deg: Annotated[Vector3, Field(description="Standard deviations of the rotation, degrees.")]
    shift_mm: Annotated[Vector3, Field(description="Translation along the right camera's axes, mm.")]
    shift_sd_mm: Annotated[Vector3, Field(description="Standard deviations of the translation, mm.")]
    marker_scale: Annotated[
        MarkerScale | None,
        Field(
            description="Null with fewer than two triads in full view, and in results of earlier versions."
        ),
    ] = None

    @classmethod
    def of(cls, check: spinewatch.matching.rig_check.RigCheck) -> RigCheck:
        """Return the contract model of the library's check."""
        values = {name: getattr(check, name) for name in cls.model_fields}
        return cls.model_validate({**values, "drifted": bool(check.drifted)})


class StageResult(Schema):
    """Everything that is measured in one stereo pair, at full precision, in mm, degrees and pixels."""

    triads: Annotated[
        list[Triad], Field(description="In label order; those without a label by their coordinate, last.")
    ]
    flags: Annotated[list[Flag], Field(description="Doubts about the result.")]
    rig_check: Annotated[
        RigCheck | None, Field(description="Null when there were too few balls to check the rig.")
    ]
    exposure: Annotated[ExposurePair, Field(description="How the images are exposed.")]
    fields: Annotated[FieldPair, Field(description="The surgical fields that were searched.")]
    version: Annotated[str, Field(description="Version of Spinewatch.")]
    templates: Annotated[
        str | None, Field(description="Version of the template set; null in results of version 0.1.0.")
    ] = None
    parameters: Annotated[dict[str, Any], Field(description="All parameters of the method, as they ran.")]
    features: Annotated[FeaturePair, Field(description="Possible ball centres, best score first.")]
    view_delay_s: Annotated[
        Number | None,
        Field(
            description="Time of the right exposure minus that of the left one, s; null without these times."
        ),
    ] = None
    labelled_by: Annotated[
        LabelSource | None,
        Field(description="What decided on the labels; null when the images of this stage did."),
    ] = None
    burst: Annotated[
        Burst | None,
        Field(
            description="The pairs of a burst, null for a single pair. Poses are then means over it; balls, features,"
            " fields, exposure and the check of the rig are those of one pair, the first that shows them."
        ),
    ] = None
    removed: Annotated[
        list[RemovedTriad],
        Field(description="Triads that persons removed in this revision and those before it."),
    ] = Field(default_factory=list)

    @classmethod
    def of(
        cls,
        measurement: spinewatch.stage.StageMeasurement,
        version: str,
        settings: Mapping[str, Any] | None = None,
    ) -> StageResult:
        """Return the contract model of a measurement; raise ``ValueError`` for a number that is not finite."""
        left, right = measurement.left, measurement.right
        check = measurement.rig_check
        return cls(
            features=FeaturePair.of(left.features, right.features),
            fields=FieldPair.of(left.field, right.field),
            exposure=ExposurePair(left=str(left.exposure), right=str(right.exposure)),
            triads=[Triad.of(triad) for triad in measurement.triads],
            flags=Flag.of(measurement.flags),
            rig_check=None if check is None else RigCheck.of(check),
            parameters={**to_jsonable_python(measurement.parameters), **(settings or {})},
            templates=measurement.templates_version,
            version=version,
        )


class CountPair(Schema):
    """Number of features in both images."""

    left: Annotated[int, Field(description="Number in the left image.")]
    right: Annotated[int, Field(description="Number in the right image.")]


class Stage(Schema):
    """One take of a stage; what is measured is null until the job has succeeded."""

    id: Annotated[Identifier, Field(description="Identifier of this take.")]
    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    name: StageName
    take: Annotated[
        int, Field(ge=1, description="Number of the take of this name; results are of the latest.")
    ]
    calibration_id: Annotated[Identifier, Field(description="Identifier of the calibration.")]
    captured_at: Annotated[Timestamp | None, Field(description="Time of capture as sent; null when unknown.")]
    left_exposed_at: Annotated[
        Timestamp | None, Field(description="Time of exposure of the left view as sent, of the first pair.")
    ] = None
    right_exposed_at: Annotated[
        Timestamp | None, Field(description="Time of exposure of the right view as sent, of the first pair.")
    ] = None
    created_at: Timestamp
    images: Annotated[ImagePair, Field(description="The two images, of the first pair.")]
    pairs: Annotated[int, Field(ge=1, description="Number of stereo pairs: 1, or those of a burst.")] = 1
    state: Annotated[JobState, Field(description="State of the job that measures it.")]
    job: Annotated[Job, Field(description="The job that measures it.")]
    features: Annotated[CountPair | None, Field(description="Number of features.")]
    triads: Annotated[int | None, Field(description="Number of triads.")]
    flags: Annotated[list[Flag] | None, Field(description="Doubts about the result.")]
    version: Annotated[str | None, Field(description="Version of Spinewatch that measured it.")]
    labelled_by: Annotated[
        LabelSource | None,
        Field(description="What decided on the labels; null when the images of this stage did."),
    ] = None
    revision: Annotated[
        Revision | None,
        Field(description="What was changed of an earlier take; null for a take with images of its own."),
    ] = None
    measuring: Annotated[
        Measuring | None,
        Field(
            description="What was sent of the measurement with the images; null for a revision, or for nothing."
        ),
    ] = None


class StageTriads(Schema):
    """The triads of a measured stage."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    frame: Annotated[
        str,
        Field(description="Name of the coordinate system.", examples=["object space of calibration cart 1"]),
    ]
    triads: Annotated[list[Triad], Field(description="In label order, unlabelled ones last.")]
    flags: Annotated[list[Flag], Field(description="Doubts about the result.")]
    parameters: Annotated[dict[str, Any], Field(description="All parameters of the method, as they ran.")]
    templates: Annotated[
        str | None, Field(description="Version of the template set; null in results of version 0.1.0.")
    ]
    version: Annotated[str, Field(description="Version of Spinewatch that measured it.")]
    labelled_by: Annotated[
        LabelSource | None,
        Field(description="What decided on the labels; null when the images of this stage did."),
    ] = None
    revision: Annotated[
        Revision | None,
        Field(description="What was changed of an earlier take; null for a take with images of its own."),
    ] = None
