"""What routes ask for: the record, the bell, a body of the right kind, and how they accept work."""

from __future__ import annotations

from typing import Annotated, Any

import structlog
from fastapi import Depends, HTTPException, Request

from contract.base import Problem
from service.problems import STATUS_NAMES
from store.database import Database
from store.queue import JobQueue

_log = structlog.get_logger("service")


def _record(request: Request) -> Database:
    record: Database = request.app.state.record
    return record


def _bell(request: Request) -> JobQueue:
    bell: JobQueue = request.app.state.bell
    return bell


TheDatabase = Annotated[Database, Depends(_record)]
TheQueue = Annotated[JobQueue, Depends(_bell)]


def json_body(request: Request) -> None:
    """Refuse a body that does not say that it is JSON."""
    _require(request, "application/json")


def multipart_body(request: Request) -> None:
    """Refuse a body that does not say that it is a multipart form."""
    _require(request, "multipart/form-data")


def _require(request: Request, media_type: str) -> None:
    given = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if given != media_type:
        raise HTTPException(415, f"send this request as {media_type}", {"Accept": media_type})


ACCEPTED: dict[int | str, dict[str, Any]] = {
    202: {"headers": {"Location": {"description": "The job.", "schema": {"type": "string"}}}}
}
"""The OpenAPI response of a route whose work a job does."""


def ring(bell: JobQueue, job_id: str) -> None:
    """Tell the workers that a job waits; one that they are not told of they find."""
    try:
        bell.ring(job_id)
    except Exception:  # the job is stored, and the workers' sweep rings again
        _log.warning("bell_not_rung", job_id=job_id, exc_info=True)


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the OpenAPI responses of a route with these problems; any route may answer 500 and 503."""
    return {
        status: {"model": Problem, "description": STATUS_NAMES[status].replace("-", " ").capitalize()}
        for status in (*statuses, 500, 503)
    }
