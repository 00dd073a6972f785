"""Dependencies of the routes: database, queue, actor, media type of the body; and OpenAPI responses they share."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated, Any

import structlog
from fastapi import Depends, HTTPException, Request

from contract.event import Actor, ActorKind
from contract.problem import Problem
from service.problems import STATUS_NAMES
from store.database import Database
from store.queue import JobQueue

_MAX_NAME_LENGTH = 128
_log = structlog.get_logger("service")


def _database(request: Request) -> Database:
    database: Database = request.app.state.database
    return database


def _queue(request: Request) -> JobQueue:
    queue: JobQueue = request.app.state.queue
    return queue


def _actor(request: Request) -> Actor:
    name = "unknown" if request.client is None else request.client.host
    return Actor(kind=ActorKind.HTTP, name=name[:_MAX_NAME_LENGTH])


def _clock_tolerance(request: Request) -> timedelta:
    tolerance: timedelta = request.app.state.clock_tolerance
    return tolerance


DatabaseDep = Annotated[Database, Depends(_database)]
QueueDep = Annotated[JobQueue, Depends(_queue)]
ActorDep = Annotated[Actor, Depends(_actor)]
ClockToleranceDep = Annotated[timedelta, Depends(_clock_tolerance)]


def json_body(request: Request) -> None:
    """Require a body of media type application/json."""
    _require_media_type(request, "application/json")


def multipart_body(request: Request) -> None:
    """Require a body of media type multipart/form-data."""
    _require_media_type(request, "multipart/form-data")


def _require_media_type(request: Request, required: str) -> None:
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type != required:
        raise HTTPException(415, f"send this request as {required}", {"Accept": required})


def enqueue(queue: JobQueue, job_id: str) -> None:
    """Enqueue a stored job; after a failure the workers' sweep enqueues it."""
    try:
        queue.enqueue(job_id)
    except Exception:
        _log.warning("job_not_enqueued", job_id=job_id, exc_info=True)


ACCEPTED: dict[int | str, dict[str, Any]] = {
    202: {"headers": {"Location": {"description": "Path of the job.", "schema": {"type": "string"}}}}
}
"""OpenAPI response of a route that submits a job."""


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the OpenAPI responses of a route with these problems, besides 500 and 503, which any route has."""
    return {
        status: {"model": Problem, "description": STATUS_NAMES[status].replace("-", " ").capitalize()}
        for status in (*statuses, 500, 503)
    }
