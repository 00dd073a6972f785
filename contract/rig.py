"""Cameras and rigs: the shape of the rig JSON.

A rig is validated once, by ``spinewatch.rig_files.rig_json.rig_from_dict``; these models show it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from annotated_types import Len
from pydantic import ConfigDict, Field, JsonValue

from contract.base import Plain, Schema, Vector2, Vector3

if TYPE_CHECKING:
    import spinewatch.camera

_EXAMPLE_CAMERA: dict[str, JsonValue] = {
    "position_mm": [-211.0, 0.0, 720.0],
    "rotation_deg": [0.4, -16.1, 0.2],
    "focal_length_mm": 8.7,
    "principal_point_mm": [0.05, -0.02],
    "radial": [0.0021, 0.0],
    "decentering": [0.0, 0.0],
    "image_size_px": [568, 416],
    "pixel_size_mm": [0.01, 0.00845],
}
_EXAMPLE_RIG: dict[str, JsonValue] = {
    "name": "cart 1",
    "left": _EXAMPLE_CAMERA,
    "right": {**_EXAMPLE_CAMERA, "position_mm": [211.0, 0.0, 720.0], "rotation_deg": [0.4, 16.1, 0.2]},
}


class Camera(Schema):
    """One calibrated camera: the collinearity model with radial and decentering distortion."""

    position_mm: Annotated[Vector3, Field(description="Perspective centre (X0, Y0, Z0) in object space, mm.")]
    rotation_deg: Annotated[Vector3, Field(description="omega, phi, kappa, degrees.")]
    focal_length_mm: Annotated[float, Field(gt=0, description="f, mm.")]
    principal_point_mm: Annotated[Vector2, Field(description="(x0, y0) on the plate, mm.")]
    radial: Annotated[Vector2, Field(description="K1 per mm^2, K2 per mm^4.")]
    decentering: Annotated[Vector2, Field(description="P1, P2 per mm.")]
    image_size_px: Annotated[
        list[Annotated[int, Field(ge=1, le=100_000)]],
        Len(2, 2),
        Plain,
        Field(description="Width and height, px."),
    ]
    pixel_size_mm: Annotated[Vector2, Field(description="Width and height of a pixel on the plate, mm.")]


class Rig(Schema):
    """Two calibrated cameras that look at the same object space."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE_RIG]})

    name: Annotated[str, Field(min_length=1, max_length=200, description="Name of the rig.")]
    left: Annotated[Camera, Field(description="The left camera.")]
    right: Annotated[Camera, Field(description="The right camera.")]

    @classmethod
    def of(cls, rig: spinewatch.camera.Rig) -> Rig:
        """Return the contract model of the library's rig."""
        return cls.model_validate(rig)
