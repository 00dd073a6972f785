"""Checks of a calibration: its age at each stage measured with it, and whether the rig had moved."""

from __future__ import annotations

from datetime import timedelta

from fastapi import APIRouter, Response

from contract.calibration_check import CalibrationCheck, CalibrationChecks
from contract.flag import Flag
from contract.stage import MarkerScale, RigCheck
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, document_response
from service.paging import CreatedSort, Paging, PartDep
from service.parameters import CalibrationId
from spinewatch.matching import marker_scale
from store import calibration_checks, calibrations, tables
from store.calibration_checks import CALIBRATION_FLAGS

router = APIRouter(prefix="/v1/calibrations", tags=["calibrations"])


@router.get(
    "/{calibration_id}/checks",
    responses={**NOT_MODIFIED, **problems(404, 422)},
    response_model=CalibrationChecks,
)
def list_calibration_checks(
    calibration_id: CalibrationId,
    database: DatabaseDep,
    part: PartDep,
    sort: CreatedSort = "-created_at",
) -> Response:
    """List the stages measured with a calibration, newest first, with its age and the drift of the rig at each.

    The scale of the markers is pooled over all its stages.
    """
    paging = Paging(part.limit, sort, part.cursor, calibration_id=calibration_id)
    with database.read() as session:
        calibration = calibrations.get(session, calibration_id)
        page = calibration_checks.listed(session, calibration_id, paging.wanted)
        scales = calibration_checks.marker_scales(session, calibration_id)
    items = [_check(stage, calibration) for stage in page.items]
    pooled = marker_scale.pooled_scale([marker_scale.MarkerScale(**scale.model_dump()) for scale in scales])
    scale = None if pooled is None else MarkerScale.model_validate(pooled)
    checks = CalibrationChecks(**paging.document(page, items), pooled_scale=scale)
    return document_response(checks, part.if_none_match)


def _check(stage: tables.stages.Stage, calibration: tables.calibrations.Calibration) -> CalibrationCheck:
    """Return the model of a row with its measurement."""
    result = {"rig_check": None, "flags": []} if stage.measurement is None else stage.measurement.result
    drift = result["rig_check"]
    return CalibrationCheck(
        surgery_id=stage.surgery_id,
        stage=stage.name,
        take=stage.take,
        taken_at=stage.captured_at or stage.created_at,
        age_days=calibrations.age(calibration, stage) / timedelta(days=1),
        drift=None if drift is None else RigCheck.model_validate(drift),
        flags=[Flag(**flag) for flag in result["flags"] if flag["code"] in CALIBRATION_FLAGS],
    )
