"""What was measured in a stage: triads, bursts, features and candidates."""

from __future__ import annotations

from fastapi import APIRouter, Response

from contract.burst import StageBurst
from contract.explanation import StageCandidates
from contract.features import StageFeatures
from contract.flag import Flag
from contract.stage import StageTriads
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.parameters import PairQuery, StagePath, SurgeryId, TakeQuery
from service.stage_documents import label_source, revision_document
from store import measurements, pair_results
from store.errors import FeaturesMissingError

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/stages", tags=["stages"])


@router.get("/{name}/triads", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageTriads)
def get_triads(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the triads of a measured stage in label order; those without a label come last."""
    with database.read() as session:
        stage, measured = measurements.get(session, surgery_id, name, take)
        triads = measurements.triads(session, stage.id)
    result = measured.result
    document = StageTriads(
        surgery_id=surgery_id,
        stage=stage.name,
        take=stage.take,
        frame=f"object space of calibration {stage.calibration.name}",
        triads=triads,
        flags=[Flag(**flag) for flag in result["flags"]],
        parameters=result["parameters"],
        templates=result["templates"],
        version=result["version"],
        labelled_by=label_source(result),
        revision=revision_document(stage),
    )
    return document_response(document, if_none_match)


@router.get("/{name}/burst", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageBurst)
def get_burst(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the poses in each pair of a burst, and the breathing in it; null for a stage of a single pair."""
    with database.read() as session:
        stage, _ = measurements.get(session, surgery_id, name, take)
        burst = measurements.burst(session, stage.id)
    return document_response(StageBurst(stage=stage.name, take=stage.take, burst=burst), if_none_match)


@router.get(
    "/{name}/features", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageFeatures
)
def get_features(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    pair: PairQuery = 1,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the possible ball centres of a pair of a measured stage, best score first."""
    with database.read() as session:
        stage, measured = measurements.get(session, surgery_id, name, take)
        found = pair_results.features(session, stage, measured, pair)
    if found is None:
        raise FeaturesMissingError(pair)
    document = StageFeatures(
        surgery_id=surgery_id,
        stage=stage.name,
        take=stage.take,
        pair=pair,
        fields=found.fields,
        exposure=found.exposure,
        features=found.features,
    )
    return document_response(document, if_none_match)


@router.get(
    "/{name}/candidates", responses={**NOT_MODIFIED, **problems(404, 409)}, response_model=StageCandidates
)
def get_candidates(
    surgery_id: SurgeryId,
    name: StagePath,
    database: DatabaseDep,
    pair: PairQuery = 1,
    take: TakeQuery = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get what became of the possible ball centres of a pair, and the candidate triads with what rejected each.

    Centres, deviations and scores are those of the features, which are named by their place there.
    """
    with database.read() as session:
        stage, _ = measurements.get(session, surgery_id, name, take)
        pair_results.require_pair(stage, pair)
        found = pair_results.find(session, stage.id, pair)
    document = StageCandidates(
        surgery_id=surgery_id,
        stage=stage.name,
        take=stage.take,
        pair=pair,
        explanation=None if found is None else found.explanation,
    )
    return document_response(document, if_none_match)
