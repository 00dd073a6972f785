"""Calibrations: the rigs that stereo pairs are taken with, as they were given or made from pictures."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

from annotated_types import Len
from fastapi import APIRouter, Depends, Form, Path, Query, Response
from fastapi.responses import HTMLResponse
from pydantic import BeforeValidator, ConfigDict, Field, JsonValue

from contract.base import (
    Identifier,
    Limit,
    Listing,
    Offset,
    Schema,
    TextTime,
    Timestamp,
    Vector2,
    Vector3,
)
from contract.calibration_report import CalibrationReportDocument
from reports.calibration import calibration_report
from service.dependencies import ACCEPTED, TheDatabase, TheQueue, json_body, multipart_body, problems, ring
from service.forms.calibration import MAX_SHOTS, CalibrationForm, read_request
from service.images import FILE_RESPONSES, IfNoneMatch, Side, file_response
from service.routes.jobs import JobDocument
from spinewatch.rig_files.rig_json import rig_from_dict
from store import calibration_checks, calibration_requests, calibrations
from store.calibration_checks import Summary
from store.clock import utc_now
from store.tables import Calibration

router = APIRouter(prefix="/v1/calibrations", tags=["calibrations"])

_ONLY_ITSELF = "default-src 'none'; style-src 'unsafe-inline'"


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
    calibrated_at: Annotated[
        Timestamp | None, Field(description="When the shots were taken; null when nobody said.")
    ]
    created_at: Timestamp
    has_report: Annotated[bool, Field(description="Whether it was made from pictures here.")]

    @classmethod
    def of(cls, row: Calibration) -> CalibrationDocument:
        """Return the document of a row."""
        return cls.model_validate(_common(row))


class ChecksSummary(Schema):
    """What the stages measured with a calibration say about it; ``/checks`` has each."""

    stages: Annotated[int, Field(description="How many were measured with it.")]
    drifted: Annotated[int, Field(description="How many found that the rig had moved.")]
    old: Annotated[int, Field(description="How many were taken when it was too old.")]


class CalibrationDetail(CalibrationDocument):
    """A calibration with all that is known of it."""

    report: Annotated[
        CalibrationReportDocument | None, Field(description="Null unless it was made from pictures here.")
    ]
    checks: ChecksSummary

    @classmethod
    def whole(cls, row: Calibration, summary: Summary) -> CalibrationDetail:
        """Return the document of a row with its report, and of its checks."""
        report = None if row.report is None else CalibrationReportDocument.of(row.report)
        return cls.model_validate(
            {**_common(row), "report": report, "checks": ChecksSummary(**asdict(summary))}
        )


def _common(row: Calibration) -> dict[str, Any]:
    return {
        "id": row.id,
        "name": row.name,
        "rig": row.rig,
        "calibrated_at": row.calibrated_at,
        "created_at": row.created_at,
        "has_report": row.report is not None,
    }


@router.post("", status_code=201, dependencies=[Depends(json_body)], responses=problems(413, 415, 422))
def create_calibration(
    rig: RigDocument,
    record: TheDatabase,
    response: Response,
    calibrated_at: Annotated[
        TextTime | None, Query(description="When it was calibrated: RFC 3339 with a zone.")
    ] = None,
) -> CalibrationDetail:
    """Add a calibration that was made elsewhere; it never changes afterwards."""
    checked = rig_from_dict(rig.model_dump())
    with record.writing() as session:
        row = calibrations.add(session, checked, utc_now(), calibrated_at)
    response.headers["Location"] = f"{router.prefix}/{row.id}"
    return CalibrationDetail.whole(row, Summary(stages=0, drifted=0, old=0))


@router.post(
    "/from-images",
    status_code=202,
    dependencies=[Depends(multipart_body)],
    responses={**ACCEPTED, **problems(400, 413, 415, 422)},
)
def calibrate_from_images(
    form: Annotated[CalibrationForm, Form(media_type="multipart/form-data")],
    record: TheDatabase,
    bell: TheQueue,
    response: Response,
) -> JobDocument:
    """Send shots of a control field to calibrate with; everything is stored, or nothing.

    ``left`` and ``right`` come once for each shot, in order; the first defines object space. The job names the
    calibration once it has succeeded, and says what was wrong with the shots when it failed.
    """
    new = read_request(form)
    with record.writing() as session:
        request = calibration_requests.submit(session, new, utc_now())
    ring(bell, request.job.id)
    response.headers["Location"] = f"/v1/jobs/{request.job.id}"
    return JobDocument.of(request.job, None)


@router.get("", responses=problems(422))
def list_calibrations(
    record: TheDatabase, limit: Limit = 50, offset: Offset = 0
) -> Listing[CalibrationDocument]:
    """List the calibrations, oldest first."""
    with record.reading() as session:
        page = calibrations.listed(session, limit, offset)
    items = [CalibrationDocument.of(row) for row in page.items]
    return Listing(items=items, total=page.total, limit=limit, offset=offset)


@router.get("/{calibration_id}", responses=problems(404))
def get_calibration(calibration_id: str, record: TheDatabase) -> CalibrationDetail:
    """Show a calibration with its report and a summary of its checks."""
    with record.reading() as session:
        row = calibrations.get_with_report(session, calibration_id)
        return CalibrationDetail.whole(row, calibration_checks.summary(session, calibration_id))


@router.get(
    "/{calibration_id}/report",
    response_class=HTMLResponse,
    responses={200: {"description": "One page that needs nothing but itself."}, **problems(404)},
)
def get_calibration_report(calibration_id: str, record: TheDatabase) -> HTMLResponse:
    """Show the report of a calibration made from pictures, to read and to print."""
    with record.reading() as session:
        row = calibrations.get_with_report(session, calibration_id)
        report = calibrations.report_of(row)
    at = None if row.calibrated_at is None else row.calibrated_at.isoformat(timespec="seconds")
    page = calibration_report({**report.report, "rig": row.rig, "calibrated_at": at})
    return HTMLResponse(page, headers={"Content-Security-Policy": _ONLY_ITSELF})


@router.get(
    "/{calibration_id}/shots/{number}/images/{side}", response_class=Response, responses=FILE_RESPONSES
)
def get_calibration_image(
    calibration_id: str,
    number: Annotated[int, Path(ge=1, le=MAX_SHOTS, description="Counts the shots from 1.")],
    side: Side,
    record: TheDatabase,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return a picture that a calibration was made from or verified with; its ETag is its SHA-256."""
    with record.reading() as session:
        row = calibrations.get_with_report(session, calibration_id)
        shot = calibrations.shot_of(row, number)
        return file_response(session, shot.left if side == "left" else shot.right, if_none_match)
