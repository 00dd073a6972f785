"""A calibration's own checks: how old it was at each stage measured with it, and whether the rig had drifted."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from contract.base import Identifier, Limit, Listing, Offset, Schema, StageName, Timestamp, Vector3
from contract.results import FlagDocument
from service.dependencies import TheDatabase, problems
from store import calibration_checks, calibrations
from store.calibration_checks import DOUBTS
from store.tables import Calibration, Stage

router = APIRouter(prefix="/v1/calibrations", tags=["calibrations"])


class DriftDocument(Schema):
    """What the balls of a stage say: the likeliest move of the right camera relative to the left one."""

    balls: Annotated[int, Field(description="Balls seen in both views.")]
    rms_px: Annotated[float, Field(description="Distances from epipolar lines in the right picture, px.")]
    chance: Annotated[float, Field(description="Of residuals like these without a move.")]
    drifted: bool
    turn_deg: Annotated[Vector3, Field(description="About the right camera's axes.")]
    turn_sd_deg: Vector3
    shift_mm: Annotated[Vector3, Field(description="Along the right camera's axes.")]
    shift_sd_mm: Vector3


class CheckDocument(Schema):
    """One measured stage."""

    surgery_id: Identifier
    stage: StageName
    take: int
    taken_at: Annotated[Timestamp, Field(description="When it was captured, or else received.")]
    age_days: Annotated[float, Field(description="Age of the calibration then; negative: made afterwards.")]
    drift: Annotated[DriftDocument | None, Field(description="Null when too few balls were seen to tell.")]
    flags: Annotated[list[FlagDocument], Field(description="Those about the calibration.")]

    @classmethod
    def of(cls, stage: Stage, calibration: Calibration) -> CheckDocument:
        """Return the document of a row with its measurement."""
        measured = stage.measurement
        check = None if measured is None else measured.rig_check
        flags = [] if measured is None else measured.flags
        return cls(
            surgery_id=stage.surgery_id,
            stage=stage.name,
            take=stage.take,
            taken_at=stage.captured_at or stage.created_at,
            age_days=calibrations.age(calibration, stage) / timedelta(days=1),
            drift=None if check is None else DriftDocument.model_validate(check),
            flags=[FlagDocument(**flag) for flag in flags if flag["code"] in DOUBTS],
        )


@router.get("/{calibration_id}/checks", responses=problems(404, 422))
def list_calibration_checks(
    calibration_id: str, record: TheDatabase, limit: Limit = 50, offset: Offset = 0
) -> Listing[CheckDocument]:
    """List the stages measured with a calibration, oldest first: its age at each, and what the balls say."""
    with record.reading() as session:
        calibration = calibrations.get(session, calibration_id)
        page = calibration_checks.listed(session, calibration_id, limit, offset)
    items = [CheckDocument.of(stage, calibration) for stage in page.items]
    return Listing(items=items, total=page.total, limit=limit, offset=offset)
