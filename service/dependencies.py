"""Dependencies of the routes: database, queue, actor, media type of the body; and OpenAPI responses they share."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated, Any

import structlog
from fastapi import Depends, HTTPException, Request

from contract.event import Actor, ActorKind
from contract.problem import Problem
from service.access import PRINCIPAL, Principal
from service.forms.parts import check_parts
from service.problems import STATUS_NAMES
from settings.patterns import TextPattern
from store.admissions import Admission
from store.database import Database
from store.queue import JobQueue

_MAX_NAME_LENGTH = 128
_MAX_ADDRESS_LENGTH = 64
_log = structlog.get_logger("service")

# Those that wait for nothing are async too: any other runs in a thread, which costs more than what it does.


async def _database(request: Request) -> Database:
    database: Database = request.app.state.database
    return database


async def _queue(request: Request) -> JobQueue:
    queue: JobQueue = request.app.state.queue
    return queue


def _principal_of(request: Request) -> Principal:
    principal: Principal | None = getattr(request.state, PRINCIPAL, None)
    if principal is None:
        raise RuntimeError(
            "the route needs no key, so that nobody is known; give it a scope in service/scopes.py"
        )
    return principal


async def _principal(request: Request) -> Principal:
    return _principal_of(request)


async def _admission(request: Request) -> Admission:
    principal = _principal_of(request)
    return Admission(principal.prefix, principal.session_token)


async def _known(request: Request) -> bool:
    return getattr(request.state, PRINCIPAL, None) is not None


async def _actor(request: Request) -> Actor:
    address = "unknown" if request.client is None else request.client.host[:_MAX_ADDRESS_LENGTH]
    principal: Principal | None = getattr(request.state, PRINCIPAL, None)
    return Actor(
        kind=ActorKind.HTTP,
        name=address if principal is None else f"{principal.prefix} {principal.name}"[:_MAX_NAME_LENGTH],
        key=None if principal is None else principal.prefix,
        address=address,
        request_id=getattr(request.state, "request_id", None),
    )


async def _clock_tolerance(request: Request) -> timedelta:
    tolerance: timedelta = request.app.state.clock_tolerance
    return tolerance


async def _reference_pattern(request: Request) -> TextPattern:
    pattern: TextPattern = request.app.state.reference_pattern
    return pattern


DatabaseDep = Annotated[Database, Depends(_database)]
QueueDep = Annotated[JobQueue, Depends(_queue)]
ActorDep = Annotated[Actor, Depends(_actor)]
KnownDep = Annotated[bool, Depends(_known)]
AdmissionDep = Annotated[Admission, Depends(_admission)]
PrincipalDep = Annotated[Principal, Depends(_principal)]
ReferencePatternDep = Annotated[TextPattern, Depends(_reference_pattern)]
ClockToleranceDep = Annotated[timedelta, Depends(_clock_tolerance)]


async def json_body(request: Request) -> None:
    """Require a body of media type application/json."""
    _require_media_type(request, "application/json")


async def multipart_body(request: Request) -> None:
    """Require a body of media type multipart/form-data whose parts can be used."""
    _require_media_type(request, "multipart/form-data")
    await check_parts(request)


async def csv_body(request: Request) -> None:
    """Require a body of media type text/csv."""
    _require_media_type(request, "text/csv")


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


CREATED: dict[int | str, dict[str, Any]] = {
    201: {"headers": {"Location": {"description": "Path of what was made.", "schema": {"type": "string"}}}}
}
"""OpenAPI response of a route that makes something."""

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
