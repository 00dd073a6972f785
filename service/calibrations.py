"""Calibrations: the rigs that stereo pairs are taken with."""

from __future__ import annotations

from typing import Annotated, Any

from annotated_types import Len
from fastapi import APIRouter, Depends, Response
from pydantic import BeforeValidator, ConfigDict, Field, JsonValue

from service.dependencies import TheRecord, json_body, problems
from service.schema import Identifier, Limit, Listing, Offset, Schema, Timestamp, Vector2, Vector3
from spinewatch.formats.rig_json import rig_from_dict
from store import calibrations
from store.clock import utc_now
from store.tables import Calibration

router = APIRouter(prefix="/v1/calibrations", tags=["calibrations"])


def _whole(value: Any) -> Any:
    return int(value) if isinstance(value, float) and value.is_integer() else value


Pixels = Annotated[int, BeforeValidator(_whole), Field(ge=1, le=100_000)]

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


class CameraDocument(Schema):
    """One calibrated camera: the collinearity model with radial and decentering distortion."""

    position_mm: Annotated[Vector3, Field(description="Perspective centre (X0, Y0, Z0) in object space, mm.")]
    rotation_deg: Annotated[Vector3, Field(description="omega, phi, kappa, degrees.")]
    focal_length_mm: Annotated[float, Field(gt=0, description="mm.")]
    principal_point_mm: Annotated[Vector2, Field(description="(x0, y0) on the plate, mm.")]
    radial: Annotated[Vector2, Field(description="K1 per mm^2, K2 per mm^4.")]
    decentering: Annotated[Vector2, Field(description="P1, P2 per mm.")]
    image_size_px: Annotated[list[Pixels], Len(2, 2), Field(description="Width, height.")]
    pixel_size_mm: Annotated[Vector2, Field(description="Width and height of a pixel on the plate, mm.")]


class RigDocument(Schema):
    """Two calibrated cameras that look at the same object space."""

    model_config = ConfigDict(json_schema_extra={"examples": [_EXAMPLE_RIG]})

    name: Annotated[str, Field(min_length=1, max_length=200)]
    left: CameraDocument
    right: CameraDocument


class CalibrationDocument(Schema):
    """A calibration in the record."""

    id: Identifier
    name: str
    rig: RigDocument
    created_at: Timestamp

    @classmethod
    def of(cls, row: Calibration) -> CalibrationDocument:
        """Return the document of a row."""
        return cls(
            id=row.id, name=row.name, rig=RigDocument.model_validate(row.rig), created_at=row.created_at
        )


@router.post("", status_code=201, dependencies=[Depends(json_body)], responses=problems(413, 415, 422))
def create_calibration(rig: RigDocument, record: TheRecord, response: Response) -> CalibrationDocument:
    """Add a calibration; it never changes afterwards."""
    checked = rig_from_dict(rig.model_dump())
    with record.writing() as session:
        row = calibrations.add(session, checked, utc_now())
    response.headers["Location"] = f"{router.prefix}/{row.id}"
    return CalibrationDocument.of(row)


@router.get("", responses=problems(422))
def list_calibrations(
    record: TheRecord, limit: Limit = 50, offset: Offset = 0
) -> Listing[CalibrationDocument]:
    """List the calibrations, oldest first."""
    with record.reading() as session:
        page = calibrations.listed(session, limit, offset)
    items = [CalibrationDocument.of(row) for row in page.items]
    return Listing(items=items, total=page.total, limit=limit, offset=offset)


@router.get("/{calibration_id}", responses=problems(404))
def get_calibration(calibration_id: str, record: TheRecord) -> CalibrationDocument:
    """Show a calibration."""
    with record.reading() as session:
        return CalibrationDocument.of(calibrations.get(session, calibration_id))
