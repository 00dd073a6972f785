"""Measures: their definitions, and those of a stage."""

from __future__ import annotations

from fastapi import APIRouter, Response

from contract.measure_definition import MeasureDefinitions, measure_definitions
from contract.spine import StageSpine
from contract.stage_measures import StageMeasures
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.parameters import StagePath, SurgeryId
from store import spines

router = APIRouter(prefix="/v1", tags=["spine"])


@router.get(
    "/measure-definitions", responses={**NOT_MODIFIED, **problems()}, response_model=MeasureDefinitions
)
def list_measure_definitions(if_none_match: IfNoneMatch = None) -> Response:
    """List the definitions of all measures: formula, sign and reference."""
    return document_response(measure_definitions(), if_none_match)


@router.get(
    "/surgeries/{surgery_id}/stages/{name}/measures",
    responses={**NOT_MODIFIED, **problems(404, 409)},
    response_model=StageMeasures,
)
def get_stage_measures(
    surgery_id: SurgeryId, name: StagePath, database: DatabaseDep, if_none_match: IfNoneMatch = None
) -> Response:
    """Get the measures of a stage, their changes, how much came with rotation, and what remains to the target."""
    with database.read() as session:
        text = spines.get(session, surgery_id, name)
    return document_response(StageMeasures.of(StageSpine.model_validate_json(text)), if_none_match)
