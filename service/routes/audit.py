"""The audit, for administrators: who did what, from where, with which outcome."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from contract.audit import AuditEvent
from contract.page import Listing
from service.dependencies import DatabaseDep, problems
from service.paging import Limit
from store import audit

router = APIRouter(prefix="/v1/audit", tags=["access"])

Cursor = Annotated[
    str | None,
    Query(
        pattern=r"^[1-9][0-9]{0,17}$",
        description="Where the page begins: `next_cursor` of the page before, the number of its last event.",
    ),
]
OfSurgery = Annotated[
    str | None,
    Query(min_length=1, max_length=64, description="Only events of this surgery, also after its deletion."),
]


@router.get("", responses=problems(422))
def list_audit_events(
    database: DatabaseDep, limit: Limit = 50, cursor: Cursor = None, surgery_id: OfSurgery = None
) -> Listing[AuditEvent]:
    """List the events of the audit, newest first."""
    before = None if cursor is None else int(cursor)
    with database.read() as session:
        page = audit.listed(session, limit, before, surgery_id)
    following = None if page.next is None else str(page.next)
    return Listing(items=list(page.items), total=page.total, limit=limit, next_cursor=following)
