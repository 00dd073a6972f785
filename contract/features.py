"""Features: possible ball centres of a pair, and where and how they were searched."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from annotated_types import Len
from pydantic import Field

from contract.base import Identifier, Schema, StageName, Vector2

if TYPE_CHECKING:
    import spinewatch.detection.candidates.surgical_field
    import spinewatch.detection.features


class Feature(Schema):
    """A possible ball centre."""

    x: Annotated[float, Field(description="u to the right, px; 0 is the centre of the first pixel.")]
    y: Annotated[float, Field(description="v downwards, px.")]
    score: Annotated[float, Field(description="Similarity to a ball, 0 to 1.")]
    sd_px: Annotated[Vector2, Field(description="Standard deviations along u and v, px.")]
    correlation: Annotated[
        float,
        Field(
            ge=-1,
            le=1,
            description="Correlation of the errors along u and v; 0 in results of earlier versions.",
        ),
    ] = 0.0
    visible_fraction: Annotated[
        float | None,
        Field(description="Visible fraction of the outline if it is a ball, 0 to 1; null if not estimated."),
    ] = None
    manual: Annotated[bool, Field(description="Whether a person placed it.")] = False

    @classmethod
    def of(cls, features: spinewatch.detection.features.Features) -> list[Feature]:
        """Return the contract models of the library's features, in their order."""
        return [cls.model_validate(values) for values in _values(features)]


class FeaturePair(Schema):
    """Features of both images, best score first."""

    left: Annotated[list[Feature], Field(description="Features of the left image.")]
    right: Annotated[list[Feature], Field(description="Features of the right image.")]

    @classmethod
    def of(
        cls,
        left: spinewatch.detection.features.Features,
        right: spinewatch.detection.features.Features,
    ) -> FeaturePair:
        """Return the contract model of the features of both images."""
        # at once: one call for each of a hundred models takes three times as long
        return cls.model_validate({"left": _values(left), "right": _values(right)})

    def library(
        self,
    ) -> tuple[spinewatch.detection.features.Features, spinewatch.detection.features.Features]:
        """Return the library's features of the left and of the right image."""
        return _library(self.left), _library(self.right)


Box = Annotated[
    list[int], Len(4, 4), Field(description="u0, v0, u1, v1 of the surgical field, px, ends excluded.")
]


class FieldPair(Schema):
    """The surgical field in both images."""

    left: Annotated[Box, Field(description="Field of the left image.")]
    right: Annotated[Box, Field(description="Field of the right image.")]

    @classmethod
    def of(
        cls,
        left: spinewatch.detection.candidates.surgical_field.SurgicalField,
        right: spinewatch.detection.candidates.surgical_field.SurgicalField,
    ) -> FieldPair:
        """Return the contract model of the library's fields."""
        boxes = ([field.u0, field.v0, field.u1, field.v1] for field in (left, right))
        return cls(left=next(boxes), right=next(boxes))


class ExposurePair(Schema):
    """How both images are exposed: normal, dark, very_dark, glare or blank."""

    left: Annotated[str, Field(description="Exposure of the left image.")]
    right: Annotated[str, Field(description="Exposure of the right image.")]


class StageFeatures(Schema):
    """The features of a measured stage, and where and how they were searched."""

    surgery_id: Annotated[Identifier, Field(description="Identifier of the surgery.")]
    stage: StageName
    take: Annotated[int, Field(description="Number of the take.")]
    fields: Annotated[FieldPair, Field(description="The surgical fields that were searched.")]
    exposure: Annotated[ExposurePair, Field(description="How the images are exposed.")]
    features: Annotated[FeaturePair, Field(description="Possible ball centres.")]
    pair: Annotated[int, Field(ge=1, description="Number of the pair; 1 unless the stage is a burst.")] = 1


def _values(features: spinewatch.detection.features.Features) -> list[dict[str, Any]]:
    """Return the values of a ``Feature`` for each of the library's features, in their order."""
    covariance = features.covariance_px2
    deviations = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
    correlations = (covariance[:, 0, 1] / deviations.prod(axis=-1)).clip(-1, 1)
    visible = [None] * len(features) if features.visible is None else features.visible.tolist()
    return [
        {
            "x": x,
            "y": y,
            "score": score,
            "sd_px": sd,
            "correlation": correlation,
            "visible_fraction": fraction,
            "manual": manual,
        }
        for (x, y), score, sd, correlation, fraction, manual in zip(
            features.xy_px.tolist(),
            features.score.tolist(),
            deviations.tolist(),
            correlations.tolist(),
            visible,
            features.is_manual.tolist(),
            strict=True,
        )
    ]


def _library(features: list[Feature]) -> spinewatch.detection.features.Features:
    from spinewatch.detection.features import Features  # noqa: PLC0415 - only who measures needs it

    deviations = np.array([feature.sd_px for feature in features]).reshape(-1, 2)
    correlations = np.array([feature.correlation for feature in features])
    covariance = deviations[:, :, None] * deviations[:, None, :]
    covariance[:, 0, 1] *= correlations
    covariance[:, 1, 0] *= correlations
    known = [feature.visible_fraction for feature in features]
    visible = np.array([1.0 if fraction is None else fraction for fraction in known])
    manual = np.array([feature.manual for feature in features], dtype=bool)
    return Features(
        np.array([[feature.x, feature.y] for feature in features]).reshape(-1, 2),
        np.array([feature.score for feature in features]),
        covariance,
        None if None in known else visible,
        manual if manual.any() else None,
    )
