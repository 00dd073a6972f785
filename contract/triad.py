"""Triads: their balls, labels and poses in object space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field

from contract.base import Number, Schema, Vector2, Vector3, plain
from contract.pose import PoseFields, pose_fields

if TYPE_CHECKING:
    import spinewatch.triads.labels
    import spinewatch.triads.pose


class PlacedCentre(Schema):
    """A ball centre that a person placed, beside what was detected in the image."""

    side: Annotated[Literal["left", "right"], Field(description="The image.")]
    feature: Annotated[
        Vector2 | None,
        Field(
            description="Nearest detected feature like a ball that no other ball uses (u, v), px; null when there is"
            " none within three radii: nothing in the image confirms the centre, and its deviation is wider."
        ),
    ]
    distance_px: Annotated[Number | None, Field(description="Distance from it, px; null without one.")]
    distance_sd: Annotated[
        Number | None,
        Field(
            description="The same, in standard deviations of a centre that a person placed on it; null without one."
        ),
    ]


class Ball(Schema):
    """One reconstructed ball of a marker."""

    position_mm: Annotated[Vector3, Field(description="Centre in object space, mm.")]
    sd_mm: Annotated[Vector3, Field(description="Standard deviations of the centre, mm.")]
    left: Annotated[
        Vector2 | None, Field(description="Centre in the left image (u, v), px; null where hidden.")
    ]
    right: Annotated[
        Vector2 | None, Field(description="Centre in the right image (u, v), px; null where hidden.")
    ]
    parallax_mm: Annotated[
        Number | None,
        Field(description="Shortest distance between the two rays, mm; null for one ray."),
    ]
    manual: Annotated[
        list[Literal["left", "right"]], Field(description="Images in which a person placed the centre.")
    ] = Field(default_factory=list)
    placed: Annotated[
        list[PlacedCentre],
        Field(description="The same centres beside what was detected; empty in results of earlier versions."),
    ] = Field(default_factory=list)

    @classmethod
    def of(cls, ball: spinewatch.triads.pose.Ball) -> Ball:
        """Return the contract model of the library's ball."""
        return cls(
            position_mm=plain(ball.position_mm),
            sd_mm=plain(np.sqrt(np.diagonal(ball.covariance_mm2))),
            left=plain(ball.left_px),
            right=plain(ball.right_px),
            parallax_mm=ball.parallax_mm,
            manual=list(ball.manual_in),
            placed=[
                PlacedCentre(
                    side=side,
                    feature=centre.feature_px and list(centre.feature_px),
                    distance_px=centre.distance_px,
                    distance_sd=centre.distance_sd,
                )
                for side, centre in ball.placed.items()
            ],
        )


class _Identity(Schema):
    label: Annotated[str | None, Field(description="The vertebra; null when it is not certain.")]
    label_reason: Annotated[str | None, Field(description="Why there is no label.")]
    label_manual: Annotated[
        bool, Field(description="Whether a person confirmed or changed the label, or took it away.")
    ] = False
    model: Annotated[str, Field(description="Name of the triad model.")]


class Triad(PoseFields, _Identity):
    """A triad in object space."""

    error_mm: Annotated[
        Number, Field(description="Distance-matrix error, mm; a residual, which finds gross errors only.")
    ]
    balls: Annotated[dict[str, Ball], Field(description="The balls by name: XX, YY, MX.")]

    @classmethod
    def of(cls, labelled: spinewatch.triads.labels.LabelledTriad) -> Triad:
        """Return the contract model of the library's triad; raise ``ValueError`` for a number that is not finite."""
        measured = labelled.triad
        return cls(
            label=labelled.label,
            label_reason=labelled.label_reason,
            model=measured.model,
            **pose_fields(measured.pose, measured.reason),
            error_mm=measured.error_mm,
            balls={name: Ball.of(ball) for name, ball in measured.balls.items()},
        )
