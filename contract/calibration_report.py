"""What is known of a calibration made from pictures, as documents: what ``spinewatch calibrate`` prints.

A report is kept as the version that made it wrote it; what a later version adds is shown as it stands.
"""

from __future__ import annotations

from typing import Annotated

from annotated_types import Len
from pydantic import ConfigDict, Field

from contract.base import Schema, Vector2, Vector3
from contract.results import FlagDocument
from service.images import PairDocument
from store.tables import CalibrationReport

Known = float | None
Known3 = Annotated[list[Known], Len(3, 3)]


class Part(Schema):
    """Base of all parts of a report; a number that is not known is null."""

    model_config = ConfigDict(extra="allow")


class ControlFieldDocument(Part):
    """The control field that was photographed."""

    name: str
    points: Annotated[int, Field(description="How many points it has.")]


class CameraQuality(Part):
    """How well one camera is known."""

    free: Annotated[list[str], Field(description="Adjusted parameters: X0, Y0, Z0, omega, phi, kappa, f ...")]
    sd: Annotated[dict[str, Known], Field(description="Their standard deviations, in the units of the rig.")]
    image_rms_px: Annotated[Known, Field(description="RMS of image residuals per coordinate, px.")]
    points: Annotated[int, Field(description="Image points in all shots used.")]


class CameraQualities(Part):
    """Both cameras."""

    left: CameraQuality
    right: CameraQuality


class CorrelationDocument(Part):
    """Two unknowns that are hard to tell apart."""

    between: Annotated[list[str], Len(2, 2)]
    correlation: float


class GeometryDocument(Part):
    """What does not depend on where object space was put."""

    baseline_mm: float
    baseline_sd_mm: Known
    vergence_deg: float
    vergence_sd_deg: Known
    range_mm: Annotated[Vector2, Field(description="Left and right, to the control field's centre.")]
    field_of_view_mm: Annotated[Vector2, Field(description="Width and height that both cameras see there.")]
    depth_of_field_mm: Annotated[
        list[Known], Len(2, 2), Field(description="Nearest, farthest; null is endless.")
    ]
    f_number: float
    control_depth_mm: Annotated[float, Field(description="Depth that the control points span.")]


class PointDocument(Part):
    """An image point of the control field."""

    id: str
    u_px: float
    v_px: float
    residual_px: Annotated[Vector2 | None, Field(description="Null in a shot that only verifies.")] = None


class PointsDocument(Part):
    """The points found in both pictures."""

    left: list[PointDocument]
    right: list[PointDocument]


class AccuracyDocument(Part):
    """Control points reconstructed less control points."""

    name: str
    used: Annotated[bool, Field(description="Whether it took part; residuals look too good then.")]
    reconstructed: Annotated[int, Field(description="How many points.")]
    mean_mm: Annotated[Known3, Field(description="Mean residual in X, Y, Z.")]
    sd_mm: Annotated[Known3, Field(description="Standard deviation of residuals in X, Y, Z.")]
    residuals_mm: Annotated[dict[str, Vector3], Field(description="By control point.")]


class ShotDocument(AccuracyDocument):
    """One shot: its pictures, the points found, and how well they are reconstructed."""

    images: PairDocument
    points: PointsDocument
    image_rms_left_px: Known
    image_rms_right_px: Known


class SizeErrorDocument(Part):
    """Errors of distances of about a size, and of angles between legs of that length, on the board itself."""

    size_mm: float
    distance_rms_mm: float
    angle_rms_deg: float
    measurements: int


class DisparityDocument(Part):
    """Where a point of the left picture appears in the right one, over the field, by height."""

    z_mm: list[float]
    u_bounds_px: Vector2
    v_bounds_px: Vector2
    mean_px: list[Vector2]
    sd_px: list[Vector2]


class RemovedDocument(Part):
    """An image point that contradicts the others."""

    side: str
    shot: str
    id: str
    miss_px: float


class CalibrationReportDocument(Part):
    """Everything that is known of a calibration beside its rig."""

    version: Annotated[str, Field(description="The version of Spinewatch that made it.")]
    control_field: ControlFieldDocument
    cameras: CameraQualities
    strong_correlations: Annotated[list[CorrelationDocument], Field(alias="correlations_above_0.9")]
    geometry: GeometryDocument
    shots: list[ShotDocument]
    leave_one_out: Annotated[
        AccuracyDocument | None,
        Field(description="Each point by the rig without it; null when undetermined."),
    ]
    angles_on_board: list[SizeErrorDocument]
    disparity: DisparityDocument | None
    removed: list[RemovedDocument]
    flags: list[FlagDocument]

    @classmethod
    def of(cls, row: CalibrationReport) -> CalibrationReportDocument:
        """Return the document of a row with its request, shots and pictures."""
        shots = [
            {**shot, "images": PairDocument.of(sent.left, sent.right)}
            for shot, sent in zip(row.report["shots"], row.request.shots, strict=True)
        ]
        return cls.model_validate({**row.report, "shots": shots, "version": row.version})
