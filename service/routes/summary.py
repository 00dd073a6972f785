"""The summary of a surgery: everything that a dashboard, a report or an export shows, in one document."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter, Response

from contract.flag import Flag
from contract.summary import SPINE_NOT_COMPUTED, SummaryStage, SurgerySummary
from service import json_text
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.images import image_pair
from service.parameters import SurgeryId
from store import summaries
from store.summaries import StageRow, SummaryRows

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/summary", tags=["spine"])

_VERSION = version("spinewatch")


@router.get("", responses={**NOT_MODIFIED, **problems(404)}, response_model=SurgerySummary)
def get_summary(surgery_id: SurgeryId, database: DatabaseDep, if_none_match: IfNoneMatch = None) -> Response:
    """Get a surgery with the measured take of each stage: triads, spine and what changed since earlier stages."""
    with database.read() as session:
        rows = summaries.get(session, surgery_id)
    return document_response(summary_json(rows), if_none_match)


def summary_json(rows: SummaryRows) -> str:
    """Return a ``SurgerySummary`` as JSON text; triads and spines are stored as it and are not parsed."""
    surgery = rows.surgery
    summary = SurgerySummary(
        surgery_id=surgery.id,
        reference=surgery.reference,
        vertebrae=surgery.vertebrae,
        reference_vertebra=surgery.reference_vertebra,
        created_at=surgery.created_at,
        setup=rows.setup,
        stages=[],
        version=_VERSION,
    )
    stages = json_text.array(_stage_json(row, has_setup=rows.setup is not None) for row in rows.stages)
    return "".join(json_text.with_members(summary, {"stages": stages}))


def _stage_json(row: StageRow, has_setup: bool) -> json_text.Parts:
    stage = row.stage
    found = SummaryStage(
        name=stage.name,
        take=stage.take,
        calibration_id=stage.calibration_id,
        state=row.state,
        captured_at=stage.captured_at,
        created_at=stage.created_at,
        images=image_pair(row.left, row.right),
        triads=None,
        flags=None if row.flags is None else [Flag(**flag) for flag in row.flags],
        version=row.version,
        spine=None,
        spine_reason=_reason(row, has_setup),
    )
    spine = None if row.spine is None else row.spine.json
    triads = ["null"] if row.triads is None else json_text.array([triad] for triad in row.triads)
    return json_text.with_members(found, {"triads": triads, "spine": [spine or "null"]})


def _reason(row: StageRow, has_setup: bool) -> str | None:
    if row.triads is None:
        return "the stage is not measured"
    if not has_setup:
        return "the surgery has no setup of the spine"
    return SPINE_NOT_COMPUTED if row.spine is None else row.spine.reason
