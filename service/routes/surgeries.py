"""Surgeries: the operations that stages belong to."""

from __future__ import annotations

from fastapi import APIRouter, Depends, Response

from contract.page import Listing
from contract.surgery import NewSurgery, StageSummary, Surgery
from service.dependencies import ActorDep, DatabaseDep, json_body, problems
from service.parameters import Limit, Offset, SurgeryId
from store import surgeries, tables
from store.clock import utc_now

router = APIRouter(prefix="/v1/surgeries", tags=["surgeries"])


@router.post("", status_code=201, dependencies=[Depends(json_body)], responses=problems(413, 415, 422))
def create_surgery(new: NewSurgery, database: DatabaseDep, actor: ActorDep, response: Response) -> Surgery:
    """Store a surgery."""
    with database.write() as session:
        row = surgeries.add(session, new, utc_now(), actor)
    response.headers["Location"] = f"{router.prefix}/{row.id}"
    return _surgery(row)


@router.get("", responses=problems(422))
def list_surgeries(database: DatabaseDep, limit: Limit = 50, offset: Offset = 0) -> Listing[Surgery]:
    """List all surgeries, oldest first."""
    with database.read() as session:
        page = surgeries.listed(session, limit, offset)
    return Listing(items=[_surgery(row) for row in page.items], total=page.total, limit=limit, offset=offset)


@router.get("/{surgery_id}", responses=problems(404))
def get_surgery(surgery_id: SurgeryId, database: DatabaseDep) -> Surgery:
    """Get a surgery with the state of its stages."""
    with database.read() as session:
        return _surgery(surgeries.get_with_stages(session, surgery_id))


def _surgery(row: tables.Surgery) -> Surgery:
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


def _summary(stage: tables.Stage) -> StageSummary:
    return StageSummary(
        name=stage.name,
        take=stage.take,
        state=stage.job.state,
        job_id=stage.job.id,
        captured_at=stage.captured_at,
        created_at=stage.created_at,
    )
