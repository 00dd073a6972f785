"""Surgeries: the operations that stages belong to."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Response

from contract.base import Identifier
from contract.page import Listing
from contract.surgery import NewSurgery, StageSummary, Surgery
from contract.text import NamedReferenceError, require_opaque
from service.dependencies import CREATED, ActorDep, DatabaseDep, ReferencePatternDep, json_body, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.idempotency import OnceDep
from service.paging import CreatedDep, Paging, PartDep, StateFilter
from service.parameters import SurgeryId
from service.problems import InvalidInputError
from service.turns import WriteTurn
from store import retention, surgeries, tables
from store.clock import utc_now

router = APIRouter(prefix="/v1/surgeries", tags=["surgeries"])


@router.post(
    "",
    status_code=201,
    dependencies=[Depends(json_body), WriteTurn],
    responses={**CREATED, **problems(413, 415, 422)},
    response_model=Surgery,
)
def create_surgery(new: NewSurgery, once: OnceDep, actor: ActorDep, pattern: ReferencePatternDep) -> Response:
    """Store a surgery."""
    try:
        require_opaque(new.reference, pattern.fullmatch)
    except NamedReferenceError as error:
        raise InvalidInputError("reference", error) from error
    with once.write() as session:
        row = surgeries.add(session, new, utc_now(), actor)
        return once.answer(_surgery(row), 201, Location=f"{router.prefix}/{row.id}")


@router.get("", responses={**NOT_MODIFIED, **problems(422)}, response_model=Listing[Surgery])
def list_surgeries(
    database: DatabaseDep,
    part: PartDep,
    created: CreatedDep,
    sort: Annotated[
        Literal["-created_at", "created_at", "reference", "-reference"],
        Query(description="Order: by age, newest first with the minus sign, or by case number."),
    ] = "-created_at",
    reference: Annotated[
        str | None, Query(min_length=1, max_length=100, description="Only surgeries of this case number.")
    ] = None,
    state: StateFilter = None,
    calibration_id: Annotated[
        Identifier | None, Query(description="Only surgeries with a take of the cameras of this calibration.")
    ] = None,
) -> Response:
    """List the surgeries, newest first."""
    filters: dict[str, Any] = {
        "reference": reference,
        "state": state,
        "calibration_id": calibration_id,
        **created,
    }
    paging = Paging(part.limit, sort, part.cursor, **filters)
    with database.read() as session:
        page = surgeries.listed(session, paging.wanted, **filters)
    items = [_surgery(row) for row in page.items]
    return document_response(
        Listing[Surgery].model_validate(paging.document(page, items)), part.if_none_match
    )


@router.get("/{surgery_id}", responses={**NOT_MODIFIED, **problems(404)}, response_model=Surgery)
def get_surgery(surgery_id: SurgeryId, database: DatabaseDep, if_none_match: IfNoneMatch = None) -> Response:
    """Get a surgery with the state of its stages."""
    with database.read() as session:
        return document_response(_surgery(surgeries.get_with_stages(session, surgery_id)), if_none_match)


@router.delete("/{surgery_id}", status_code=204, dependencies=[WriteTurn], responses=problems(404, 422))
def delete_surgery(
    surgery_id: SurgeryId,
    database: DatabaseDep,
    actor: ActorDep,
    reason: Annotated[
        str | None,
        Query(
            pattern=r"^[^\x00-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2066-\u2069\ufeff]{1,200}$",
            description="Why, for the record; never a name.",
        ),
    ] = None,
) -> None:
    """Delete a surgery: it is hidden, its jobs are cancelled, and `spinewatch purge` removes it for good."""
    with database.write() as session:
        retention.delete(session, surgery_id, reason, utc_now(), actor)


def _surgery(row: tables.surgeries.Surgery) -> Surgery:
    return Surgery.model_validate(
        {
            "id": row.id,
            "reference": row.reference,
            "vertebrae": row.vertebrae,
            "reference_vertebra": row.reference_vertebra,
            "spine_axis": row.spine_axis,
            "extra_levels": row.extra_levels,
            "created_at": row.created_at,
            "stages": [_summary(stage) for stage in row.stages],
        }
    )


def _summary(stage: tables.stages.Stage) -> StageSummary:
    return StageSummary(
        name=stage.name,
        take=stage.take,
        state=stage.job.state,
        job_id=stage.job.id,
        captured_at=stage.captured_at,
        created_at=stage.created_at,
    )
