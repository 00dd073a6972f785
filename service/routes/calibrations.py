"""Calibrations: rigs that were calibrated elsewhere, or from images of a control field here."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Depends, Form, Path, Query, Request, Response
from fastapi.responses import HTMLResponse
from pydantic import PlainValidator

import spinewatch.camera
from contract.calibration import Calibration, CalibrationBrief, CalibrationDetail, CalibrationReport
from contract.calibration_check import ChecksSummary
from contract.job import Job
from contract.page import Listing
from contract.rig import Rig
from contract.text import visible
from reports.calibration import calibration_report
from service.dependencies import (
    ACCEPTED,
    CREATED,
    ActorDep,
    ClockToleranceDep,
    DatabaseDep,
    QueueDep,
    enqueue,
    json_body,
    multipart_body,
    problems,
)
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.forms.calibration import MAX_SHOTS, CalibrationForm, read_request
from service.idempotency import OnceDep
from service.images import FILE_RESPONSES, SidePath, file_response, image_pair
from service.paging import CreatedDep, Paging, PartDep
from service.parameters import CalibrationId, TextTime, require_plausible_time
from service.routes.jobs import job_of
from service.turns import WriteTurn
from spinewatch.errors import RigError
from spinewatch.rig_files.rig_json import decode_json, rig_from_dict
from store import calibration_checks, calibration_requests, calibrations, tables
from store.clock import utc_now

router = APIRouter(prefix="/v1/calibrations", tags=["calibrations"])

_SAFE_FIELD = re.compile(r"[\w.()-]{1,64}", re.ASCII)


@contextmanager
def _printable_field() -> Iterator[None]:
    """Let an error not repeat the name of an unknown field that may be anything."""
    try:
        yield
    except RigError as error:
        if _SAFE_FIELD.fullmatch(error.field):
            raise
        raise RigError("(unprintable)", error.problem) from error


@_printable_field()
def _rig(document: object) -> spinewatch.camera.Rig:
    """Return the library's rig."""
    rig = rig_from_dict(document)
    try:
        visible(rig.name)
    except ValueError as error:
        raise RigError("name", str(error)) from error
    return rig


async def unique_fields(request: Request) -> None:
    """Refuse a rig with a field given twice, of which a decoded body has only the last."""
    body = await request.body()
    if body:
        with _printable_field():
            decode_json(body)


RigBody = Annotated[Any, PlainValidator(_rig, json_schema_input_type=Rig), Body()]
"""A rig in a body, validated by the library; its ``RigError`` becomes the problem."""

_CONTENT_SECURITY_POLICY = "default-src 'none'; style-src 'unsafe-inline'"


@router.post(
    "",
    status_code=201,
    dependencies=[Depends(json_body), Depends(unique_fields), WriteTurn],
    responses={**CREATED, **problems(413, 415, 422)},
    response_model=CalibrationDetail,
)
def create_calibration(
    rig: RigBody,
    once: OnceDep,
    actor: ActorDep,
    tolerance: ClockToleranceDep,
    calibrated_at: Annotated[
        TextTime | None, Query(description="Time of the calibration, RFC 3339 with a time zone.")
    ] = None,
) -> Response:
    """Store a rig that was calibrated elsewhere; it cannot be changed afterwards."""
    now = utc_now()
    require_plausible_time("calibrated_at", calibrated_at, now, tolerance, "query")
    with once.write() as session:
        row = calibrations.add(session, rig, now, actor, calibrated_at)
        document = _detail(row, None, ChecksSummary(stages=0, drifted=0, old=0))
        return once.answer(document, 201, Location=f"{router.prefix}/{row.id}")


@router.post(
    "/from-images",
    status_code=202,
    dependencies=[Depends(multipart_body), WriteTurn],
    responses={**ACCEPTED, **problems(400, 409, 413, 415, 422)},
    response_model=Job,
)
def calibrate_from_images(
    form: Annotated[CalibrationForm, Form(media_type="multipart/form-data")],
    once: OnceDep,
    queue: QueueDep,
    actor: ActorDep,
    tolerance: ClockToleranceDep,
) -> Response:
    """Submit shots of a control field for calibration.

    Either everything is stored or nothing. ``left`` and ``right`` are repeated once per shot, in order; the first shot
    defines object space. The job has the identifier of the calibration when it has succeeded, and the error when it has
    failed.
    """
    now = utc_now()
    require_plausible_time("captured_at", form.captured_at, now, tolerance)
    new = read_request(form)
    with once.write() as session:
        request = calibration_requests.submit(session, new, now, actor)
        answer = once.answer(job_of(request.job, None), 202, Location=f"/v1/jobs/{request.job.id}")
    enqueue(queue, request.job.id)
    return answer


@router.get("", responses={**NOT_MODIFIED, **problems(422)}, response_model=Listing[Calibration])
def list_calibrations(
    database: DatabaseDep,
    part: PartDep,
    created: CreatedDep,
    sort: Annotated[
        Literal["-created_at", "created_at", "name", "-name"],
        Query(description="Order: by age, newest first with the minus sign, or by name."),
    ] = "-created_at",
    name: Annotated[
        str | None,
        Query(min_length=1, max_length=200, description="Only calibrations of the rig of this name."),
    ] = None,
) -> Response:
    """List the calibrations, newest first."""
    filters: dict[str, Any] = {
        "name": name,
        **created,
    }
    paging = Paging(part.limit, sort, part.cursor, **filters)
    with database.read() as session:
        page = calibrations.listed(session, paging.wanted, **filters)
        briefs = calibrations.briefs(session, [row.id for row in page.items])
    items = [Calibration.model_validate(_fields(row, briefs.get(row.id))) for row in page.items]
    listing = Listing[Calibration].model_validate(paging.document(page, items))
    return document_response(listing, part.if_none_match)


@router.get(
    "/{calibration_id}", responses={**NOT_MODIFIED, **problems(404)}, response_model=CalibrationDetail
)
def get_calibration(
    calibration_id: CalibrationId, database: DatabaseDep, if_none_match: IfNoneMatch = None
) -> Response:
    """Get a calibration with its report and a summary of its checks."""
    with database.read() as session:
        row = calibrations.get_with_report(session, calibration_id)
        brief = calibrations.briefs(session, [calibration_id]).get(calibration_id)
        document = _detail(row, brief, calibration_checks.summary(session, calibration_id))
    return document_response(document, if_none_match)


@router.get(
    "/{calibration_id}/report",
    response_class=HTMLResponse,
    responses={200: {"description": "A page without external resources."}, **problems(404)},
)
def get_calibration_report(calibration_id: CalibrationId, database: DatabaseDep) -> HTMLResponse:
    """Get the report of a calibration made from images, as an HTML page to read and print."""
    with database.read() as session:
        row = calibrations.get_with_report(session, calibration_id)
        report = calibrations.report_of(row)
    at = None if row.calibrated_at is None else row.calibrated_at.isoformat(timespec="seconds")
    page = calibration_report({**report.report, "rig": row.rig, "calibrated_at": at})
    return HTMLResponse(page, headers={"Content-Security-Policy": _CONTENT_SECURITY_POLICY})


@router.get(
    "/{calibration_id}/shots/{number}/images/{side}", response_class=Response, responses=FILE_RESPONSES
)
def get_calibration_image(
    calibration_id: CalibrationId,
    number: Annotated[int, Path(ge=1, le=MAX_SHOTS, description="Number of the shot, from 1.")],
    side: SidePath,
    database: DatabaseDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get an image that a calibration was made from or verified with; its ETag is its SHA-256."""
    with database.read() as session:
        row = calibrations.get_with_report(session, calibration_id)
        shot = calibrations.shot_of(row, number)
        image = shot.left if side == "left" else shot.right
    return file_response(database, image, if_none_match)


def _detail(
    row: tables.calibrations.Calibration, brief: CalibrationBrief | None, checks: ChecksSummary
) -> CalibrationDetail:
    report = None if row.report is None else _report(row.report)
    return CalibrationDetail.model_validate({**_fields(row, brief), "report": report, "checks": checks})


def _fields(row: tables.calibrations.Calibration, brief: CalibrationBrief | None) -> dict[str, Any]:
    return {
        "id": row.id,
        "name": row.name,
        "rig": row.rig,
        "calibrated_at": row.calibrated_at,
        "created_at": row.created_at,
        "has_report": row.report is not None,
        "brief": brief,
    }


def _report(row: tables.calibrations.CalibrationReport) -> CalibrationReport:
    """Return the model of a row with its request, shots and images; shots are named by their number."""
    shots = []
    for shot in row.report["shots"]:
        number = int(shot["name"])
        sent = row.request.shots[number - 1]
        shots.append({**shot, "number": number, "images": image_pair(sent.left, sent.right)})
    return CalibrationReport.model_validate({**row.report, "shots": shots, "version": row.version})
