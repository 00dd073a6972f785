"""Surgeries that were deleted: every path of one answers 410."""

from __future__ import annotations

from fastapi import Request
from starlette.concurrency import run_in_threadpool

from store import retention
from store.database import Database


async def require_present(request: Request) -> None:
    """Raise ``SurgeryDeletedError`` for the path of a surgery that was deleted."""
    surgery_id = request.path_params.get("surgery_id")
    if surgery_id is not None:
        await run_in_threadpool(_check, request.app.state.database, surgery_id)


def _check(database: Database, surgery_id: str) -> None:
    with database.read() as session:
        retention.require_present(session, surgery_id)
