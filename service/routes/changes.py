"""Changes of the contents, in the order in which they were committed."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from contract.base import Identifier
from contract.change import Changes
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from store import changes

router = APIRouter(prefix="/v1/changes", tags=["changes"])

MAX_NUMBER = 2**53 - 1
"""Largest number that every JSON parser reads exactly."""
SurgeryFilter = Annotated[Identifier | None, Query(description="Only changes of this surgery.")]


@router.get("", responses={**NOT_MODIFIED, **problems(422)}, response_model=Changes)
def list_changes(
    database: DatabaseDep,
    since: Annotated[
        int,
        Query(
            ge=0,
            le=MAX_NUMBER,
            description="Number of the last change that is known: `last` of the answer before.",
        ),
    ] = 0,
    limit: Annotated[int, Query(ge=1, le=1000, description="Maximum number of changes to return.")] = 100,
    surgery_id: SurgeryFilter = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """List what happened after a change, oldest first.

    Ask again with `since` set to `last`, at once unless `done`. Nothing is ever added before `last`. A `last` that is
    smaller than `since` means that a backup was restored: read everything again.
    """
    with database.read() as session:
        found = changes.listed(session, since, limit, surgery_id)
    return document_response(found, if_none_match)
