"""What was measured, as documents: triads in object space, features in pixels, flags."""

from __future__ import annotations

from typing import Annotated, Any

from annotated_types import Len
from pydantic import Field

from contract.base import Identifier, Matrix3, Matrix6, Schema, StageName, Vector2, Vector3
from store.tables import Stage, Triad


class FlagDocument(Schema):
    """A named doubt about a result."""

    code: Annotated[str, Field(description="docs/flags.md lists them.")]
    detail: str


class BallDocument(Schema):
    """One reconstructed ball."""

    position_mm: Annotated[Vector3, Field(description="Centre in object space, mm.")]
    sd_mm: Annotated[Vector3, Field(description="Standard deviations, mm.")]
    left: Annotated[
        Vector2 | None, Field(description="Centre in the left picture (u, v), px; null where hidden.")
    ]
    right: Annotated[
        Vector2 | None, Field(description="Centre in the right picture (u, v), px; null where hidden.")
    ]
    parallax_mm: Annotated[
        float | None,
        Field(description="Distance by which the two rays miss each other, mm; null for one ray."),
    ]


class TriadDocument(Schema):
    """A triad in object space; one whose balls do not determine a pose has null for all of it, and a reason."""

    label: Annotated[str | None, Field(description="The vertebra; null when it cannot be told.")]
    label_reason: Annotated[str | None, Field(description="Why there is no label.")]
    model: Annotated[str, Field(description="Name of the triad model.")]
    reason: Annotated[str | None, Field(description="Why there is no pose.")]
    position_mm: Annotated[Vector3 | None, Field(description="P, where the legs meet, mm.")]
    position_sd_mm: Annotated[Vector3 | None, Field(description="Standard deviations, mm.")]
    normal: Annotated[Vector3 | None, Field(description="Unit normal.")]
    angles_deg: Annotated[Vector3 | None, Field(description="Angles of the normal with X, Y and Z, degrees.")]
    rotation: Annotated[Matrix3 | None, Field(description="Columns are the triad's axes.")]
    rotation_sd_deg: Annotated[
        Vector3 | None, Field(description="Standard deviations about the triad's own x, y and z, degrees.")
    ]
    covariance: Annotated[
        Matrix6 | None,
        Field(description="Of position (mm) and rotation vector about the object axes (degrees)."),
    ]
    error_mm: Annotated[float, Field(description="Distance-matrix error, mm: finds gross faults only.")]
    balls: dict[str, BallDocument]

    @classmethod
    def of(cls, row: Triad) -> TriadDocument:
        """Return the document of a row."""
        return cls(
            label=row.label,
            label_reason=row.label_reason,
            model=row.model,
            reason=row.reason,
            position_mm=_vector(row.x_mm, row.y_mm, row.z_mm),
            position_sd_mm=_vector(row.x_sd_mm, row.y_sd_mm, row.z_sd_mm),
            normal=row.normal,
            angles_deg=_vector(row.alpha_deg, row.beta_deg, row.gamma_deg),
            rotation=row.rotation,
            rotation_sd_deg=row.rotation_sd_deg,
            covariance=row.covariance,
            error_mm=row.error_mm,
            balls={name: BallDocument(**ball) for name, ball in row.balls.items()},
        )


class TriadsDocument(Schema):
    """The triads of a measured stage."""

    surgery_id: Identifier
    stage: StageName
    take: int
    frame: Annotated[str, Field(examples=["object space of calibration cart 1"])]
    triads: list[TriadDocument]
    flags: list[FlagDocument]
    parameters: Annotated[dict[str, Any], Field(description="All parameters of the method.")]
    version: Annotated[str, Field(description="The version of Spinewatch that measured it.")]


class FeatureDocument(Schema):
    """A possible ball centre."""

    x: Annotated[float, Field(description="u to the right, px; 0 is the centre of the first pixel.")]
    y: Annotated[float, Field(description="v downwards, px.")]
    score: Annotated[float, Field(description="Similarity to a ball, 0 to 1.")]
    sd_px: Annotated[Vector2, Field(description="Standard deviations along u and v, px.")]
    visible_fraction: Annotated[
        float | None,
        Field(
            description="How much of the outline is seen if it is a ball, 0 to 1; null if nobody has looked."
        ),
    ] = None


class FeaturePair(Schema):
    """Features of both views."""

    left: list[FeatureDocument]
    right: list[FeatureDocument]


Box = Annotated[
    list[int], Len(4, 4), Field(description="u0, v0, u1, v1 of the surgical field, px, ends excluded.")
]


class FieldPair(Schema):
    """The surgical field in both views."""

    left: Box
    right: Box


class ExposurePair(Schema):
    """How both views are exposed."""

    left: str
    right: str


class FeaturesDocument(Schema):
    """The features of a measured stage, and where and how they were sought."""

    surgery_id: Identifier
    stage: StageName
    take: int
    fields: FieldPair
    exposure: ExposurePair
    features: FeaturePair


def _vector(*values: float | None) -> list[float] | None:
    known = [value for value in values if value is not None]
    return known if len(known) == len(values) else None


def object_space(stage: Stage) -> str:
    """Return the name of the frame that a stage's triads are in."""
    return f"object space of calibration {stage.calibration.name}"
