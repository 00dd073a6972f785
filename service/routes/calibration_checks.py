"""Checks of a calibration: its age at each stage measured with it, and whether the rig had moved."""

from __future__ import annotations

from datetime import timedelta

from fastapi import APIRouter

from contract.calibration_check import CalibrationCheck
from contract.flag import Flag
from contract.page import Listing
from contract.stage import RigCheck
from service.dependencies import DatabaseDep, problems
from service.parameters import Limit, Offset
from store import calibration_checks, calibrations, tables
from store.calibration_checks import CALIBRATION_FLAGS

router = APIRouter(prefix="/v1/calibrations", tags=["calibrations"])


@router.get("/{calibration_id}/checks", responses=problems(404, 422))
def list_calibration_checks(
    calibration_id: str, database: DatabaseDep, limit: Limit = 50, offset: Offset = 0
) -> Listing[CalibrationCheck]:
    """List the stages measured with a calibration, oldest first, with its age and the drift of the rig at each."""
    with database.read() as session:
        calibration = calibrations.get(session, calibration_id)
        page = calibration_checks.listed(session, calibration_id, limit, offset)
    items = [_check(stage, calibration) for stage in page.items]
    return Listing(items=items, total=page.total, limit=limit, offset=offset)


def _check(stage: tables.Stage, calibration: tables.Calibration) -> CalibrationCheck:
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
