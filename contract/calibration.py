"""Calibrations: a rig, and what is known of its quality.

A stored report stays as the version that made it wrote it; fields that a later version adds are shown as they are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Generic, TypeVar

from annotated_types import Len
from pydantic import AliasChoices, ConfigDict, Field

from contract.base import (
    Identifier,
    Known,
    Known2,
    Known3,
    Number,
    Plain,
    Schema,
    Timestamp,
    Vector2,
    Vector3,
    plain,
)
from contract.calibration_check import ChecksSummary
from contract.flag import Flag
from contract.image import ImagePair
from contract.rig import Rig

if TYPE_CHECKING:
    import spinewatch.calibration.quality.accuracy

Shot = TypeVar("Shot")


class Part(Schema):
    """Base of all parts of a report; a number that is not determined is null."""

    model_config = ConfigDict(extra="allow")


class ControlField(Part):
    """The control field that the images show."""

    name: Annotated[str, Field(description="Name of the control field or of its file.")]
    points: Annotated[int, Field(description="Number of points.")]


class CameraQuality(Part):
    """How well one camera is determined."""

    free: Annotated[list[str], Field(description="Adjusted parameters: X0, Y0, Z0, omega, phi, kappa, f ...")]
    sd: Annotated[dict[str, Known], Field(description="Their standard deviations, in the units of the rig.")]
    sd_limits: Annotated[
        dict[str, Known],
        Field(
            default_factory=dict,
            description="Standard deviations above which an interior parameter counts as not determined, in the same"
            " units; empty in reports of earlier versions.",
        ),
    ]
    image_rms_px: Annotated[Known, Field(description="RMS of image residuals per coordinate, px.")]
    points: Annotated[int, Field(description="Number of image points in all shots used.")]


class CameraQualityPair(Part):
    """Both cameras."""

    left: Annotated[CameraQuality, Field(description="The left camera.")]
    right: Annotated[CameraQuality, Field(description="The right camera.")]


class Correlation(Part):
    """Two strongly correlated unknowns."""

    between: Annotated[list[str], Len(2, 2), Field(description="Names of the two unknowns.")]
    correlation: Annotated[float, Field(description="Coefficient of correlation, -1 to 1.")]


class StereoGeometry(Part):
    """Relative orientation of the cameras and what they cover; independent of the choice of object space."""

    baseline_mm: Annotated[float, Field(description="Distance between the perspective centres, mm.")]
    baseline_sd_mm: Annotated[
        Known, Field(description="Its standard deviation, mm; null without redundancy.")
    ]
    vergence_deg: Annotated[float, Field(description="Angle between the optical axes, degrees.")]
    vergence_sd_deg: Annotated[
        Known, Field(description="Its standard deviation, degrees; null without redundancy.")
    ]
    range_mm: Annotated[Vector2, Field(description="Left and right, to the centre of the control field.")]
    field_of_view_mm: Annotated[
        Vector2, Field(description="Width and height visible to both cameras at that range.")
    ]
    depth_of_field_mm: Annotated[Known2, Field(description="Nearest and farthest range; null is infinite.")]
    f_number: Annotated[float, Field(description="f-number assumed for the depth of field.")]
    control_depth_mm: Annotated[float, Field(description="Depth that the control points span.")]


class ImagePoint(Part):
    """An image point of the control field."""

    id: Annotated[str, Field(description="Identifier of the control point.")]
    u_px: Annotated[float, Field(description="u to the right, px.")]
    v_px: Annotated[float, Field(description="v downwards, px.")]
    residual_px: Annotated[
        Vector2 | None, Field(description="Null where the point was not adjusted: in a shot held out.")
    ] = None


class ImagePointPair(Part):
    """The points found in both images."""

    left: Annotated[list[ImagePoint], Field(description="Points of the left image.")]
    right: Annotated[list[ImagePoint], Field(description="Points of the right image.")]


class ControlAccuracy(Part):
    """Reconstructed control points minus the control points."""

    name: Annotated[str, Field(description="Name of the shot.")]
    used: Annotated[
        bool, Field(description="Whether the shot was adjusted; its residuals are then too small.")
    ]
    reconstructed: Annotated[int, Field(description="Number of points.")]
    mean_mm: Annotated[Known3, Field(description="Mean residual in X, Y, Z.")]
    sd_mm: Annotated[Known3, Field(description="Standard deviation of residuals in X, Y, Z.")]
    residuals_mm: Annotated[dict[str, Vector3], Field(description="Residuals by control point.")]

    @classmethod
    def of(cls, accuracy: spinewatch.calibration.quality.accuracy.ShotAccuracy) -> ControlAccuracy:
        """Return the contract model of the library's residuals."""
        residuals = zip(accuracy.ids, accuracy.residuals_mm.tolist(), strict=True)
        return ControlAccuracy(
            name=accuracy.name,
            used=accuracy.used,
            reconstructed=len(accuracy.ids),
            mean_mm=plain(accuracy.mean_mm),
            sd_mm=plain(accuracy.sd_mm),
            residuals_mm=dict(residuals),
        )


class ShotQuality(ControlAccuracy):
    """The points found in one shot, and how accurately they are reconstructed."""

    points: Annotated[ImagePointPair, Field(description="Image points of both sides.")]
    image_rms_left_px: Annotated[Known, Field(description="RMS of residuals per coordinate, left image, px.")]
    image_rms_right_px: Annotated[
        Known, Field(description="RMS of residuals per coordinate, right image, px.")
    ]


class CalibrationShot(ShotQuality):
    """One shot: its images, the points found, and how accurately they are reconstructed."""

    number: Annotated[
        int, Field(description="Its number among those sent, from 1, as in the path of its images.")
    ]
    images: Annotated[ImagePair, Field(description="The two images.")]


class SizeAccuracy(Part):
    """RMS errors of distances of about one size, and of angles between legs of that length, on the board."""

    size_mm: Annotated[float, Field(description="Length of the distances and of the legs, mm.")]
    distance_rms_mm: Annotated[float, Field(description="RMS error of the distances, mm.")]
    angle_rms_deg: Annotated[float, Field(description="RMS error of the angles, degrees.")]
    measurements: Annotated[int, Field(description="Number of angles.")]


class Disparity(Part):
    """Offset of a point of the left image in the right one, over the field, by height."""

    z_mm: Annotated[list[float], Plain, Field(description="Heights.")]
    u_bounds_px: Annotated[Vector2, Field(description="Smallest and largest offset in u, px.")]
    v_bounds_px: Annotated[Vector2, Field(description="Smallest and largest offset in v, px.")]
    mean_px: Annotated[list[Vector2], Plain, Field(description="Mean offset by height.")]
    sd_px: Annotated[list[Vector2], Plain, Field(description="Its standard deviation over the field.")]


class FitLimits(Part):
    """What the calibration was compared with."""

    rms_px: Annotated[float, Field(description="Image RMS above which it is flagged, px.")]
    baseline_sd_mm: Annotated[
        Vector2,
        Field(description="Standard deviation of the baseline above which it is flagged, and refused, mm."),
    ]
    reconstruction_mm: Annotated[
        Vector2,
        Field(
            description="RMS error of the control points per coordinate above which it is flagged, and refused, mm."
        ),
    ]
    reference_sd_mm: Annotated[
        Vector3,
        Field(
            description="Standard deviations in X, Y, Z of the control points of the thesis (Table 3.4), mm."
            " Nothing is flagged by them."
        ),
    ]


class RemovedPoint(Part):
    """An image point that contradicts the others."""

    side: Annotated[str, Field(description="left or right.")]
    shot: Annotated[str, Field(description="Name of the shot.")]
    id: Annotated[str, Field(description="Identifier of the control point.")]
    residual_px: Annotated[
        Number,
        Field(
            description="Distance from where the others expect it, px.",
            validation_alias=AliasChoices("residual_px", "miss_px"),  # reports of version 0.1.0
        ),
    ]


class CalibrationQuality(Part, Generic[Shot]):
    """What is known of a calibration besides its rig."""

    model_config = ConfigDict(serialize_by_alias=True)

    control_field: Annotated[ControlField, Field(description="The control field.")]
    cameras: Annotated[CameraQualityPair, Field(description="Accuracy of the cameras' parameters.")]
    strong_correlations: Annotated[
        list[Correlation],
        Field(alias="correlations_above_0.9", description="Unknowns with a correlation above 0.9."),
    ]
    geometry: Annotated[StereoGeometry, Field(description="Relative orientation of the cameras.")]
    limits: Annotated[
        FitLimits | None,
        Field(description="Limits of the calibration; null in reports of earlier versions."),
    ] = None
    shots: Annotated[
        list[Shot],
        Field(
            description="The shots in the order in which they were sent; without those that repeat an earlier one,"
            " which are flagged."
        ),
    ]
    leave_one_out: Annotated[
        ControlAccuracy | None,
        Field(description="Each point reconstructed by the rig without it; null when undetermined."),
    ]
    angles_on_board: Annotated[
        list[SizeAccuracy], Field(description="RMS errors of distances and angles, by size.")
    ]
    disparity: Annotated[
        Disparity | None, Field(description="Disparities over the field; null when undetermined.")
    ]
    removed: Annotated[list[RemovedPoint], Field(description="Image points removed as blunders.")]
    flags: Annotated[list[Flag], Field(description="Doubts about the calibration.")]


class CalibrationResult(CalibrationQuality[ShotQuality]):
    """A calibration from images or coordinates: the rig and its quality, as computed."""

    rig: Annotated[Rig, Field(description="The calibrated cameras.")]
    version: Annotated[str, Field(description="Version of Spinewatch.")]


class CalibrationReport(CalibrationQuality[CalibrationShot]):
    """A stored calibration's quality, with the images that it was made from."""

    version: Annotated[str, Field(description="Version of Spinewatch that made it.")]


class CalibrationBrief(Schema):
    """What a list shows of the quality of a calibration made from images."""

    leave_one_out_sd_mm: Annotated[
        Known3 | None,
        Field(
            description="Standard deviations in X, Y, Z of points reconstructed by the rig without them, mm; null when"
            " undetermined."
        ),
    ]
    flags: Annotated[list[Flag], Field(description="Doubts about the calibration.")]


class Calibration(Schema):
    """A stored calibration."""

    id: Annotated[Identifier, Field(description="Identifier of the calibration.")]
    name: Annotated[str, Field(description="Name of the rig.")]
    rig: Annotated[Rig, Field(description="The calibrated cameras.")]
    calibrated_at: Annotated[
        Timestamp | None, Field(description="When the images were taken; null when unknown.")
    ]
    created_at: Timestamp
    has_report: Annotated[bool, Field(description="Whether it was made from images here.")]
    brief: Annotated[
        CalibrationBrief | None, Field(description="Its quality; null unless it was made from images here.")
    ]


class CalibrationDetail(Calibration):
    """A stored calibration with its report and a summary of its checks."""

    report: Annotated[
        CalibrationReport | None, Field(description="Null unless it was made from images here.")
    ]
    checks: Annotated[ChecksSummary, Field(description="Summary of the checks by stages measured with it.")]
