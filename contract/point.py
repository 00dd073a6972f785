"""Points that are reconstructed from given image points of a calibrated rig."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from contract.base import Number, Schema, Vector2, Vector3
from spinewatch.geometry.triangulation import Triangulation


class Point(Schema):
    """A point in object space, from its two images."""

    left: Annotated[Vector2, Field(description="Its left image (u, v), px.")]
    right: Annotated[Vector2, Field(description="Its right image (u, v), px.")]
    position_mm: Annotated[Vector3, Field(description="Its position in object space, mm.")]
    position_sd_mm: Annotated[Vector3, Field(description="Standard deviations along the object axes, mm.")]
    parallax_mm: Annotated[
        Number,
        Field(description="Distance between the two rays: large when the images are not of one point."),
    ]


class Points(Schema):
    """Reconstructed points; nothing is stored."""

    frame: Annotated[
        str,
        Field(description="Name of the coordinate system.", examples=["object space of calibration cart 1"]),
    ]
    centre_sd_px: Annotated[Number, Field(description="Standard deviation of the image points per axis, px.")]
    points: Annotated[list[Point], Field(description="In the order in which they were given.")]

    @classmethod
    def of(
        cls,
        found: Triangulation,
        images: tuple[list[list[float]], list[list[float]]],
        frame: str,
        centre_sd_px: float,
    ) -> Points:
        """Return the contract model of triangulated points."""
        rows = zip(*images, found.position_mm, found.covariance_mm2, found.parallax_mm, strict=True)
        points = [
            Point(
                left=left,
                right=right,
                position_mm=position,
                position_sd_mm=[float(covariance[k, k]) ** 0.5 for k in range(3)],
                parallax_mm=parallax,
            )
            for left, right, position, covariance, parallax in rows
        ]
        return cls(frame=frame, centre_sd_px=centre_sd_px, points=points)
