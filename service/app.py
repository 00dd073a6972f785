"""The application: routes, middleware, and the resources that they share."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import timedelta
from importlib.metadata import version
from uuid import uuid4

from fastapi import FastAPI
from fastapi.middleware.cors import CORSMiddleware
from fastapi.routing import APIRoute
from fastapi_offline import FastAPIOffline

from service import api_page, dashboard_page, idempotency, openapi, problems
from service.access import Access
from service.declared_routes import SCOPE_KEY, DeclaredRoutes
from service.dependencies import problems as problem_responses
from service.forms.calibration import MAX_SHOTS
from service.forms.stage import MAX_PAIRS
from service.key_use import KeyUse
from service.limits import MAX_TEXT_PART_BYTES, max_body_bytes
from service.metrics import Metrics, RequestMetrics, server_registry
from service.middleware.body_limit import BodyLimit
from service.middleware.compression import Compression
from service.middleware.declared_request import DeclaredRequest
from service.middleware.head import Head
from service.middleware.hosts import AllowedHosts
from service.middleware.json_check import JSONCheck
from service.middleware.origins import OwnOrigin
from service.middleware.pieces import Pieces
from service.middleware.refusals import Refusals
from service.middleware.request_log import RequestLog
from service.middleware.uploads import UploadTurns
from service.readiness import ReadinessChecks
from service.routes import (
    audit,
    calibration_checks,
    calibrations,
    changes,
    control_fields,
    events,
    exports,
    health,
    jobs,
    keys,
    legacy_motion,
    measures,
    metrics,
    motion,
    plans,
    points,
    radiographs,
    session,
    spine,
    stage_results,
    stages,
    summary,
    surgeries,
)
from service.turns import Turns
from service.watch import Watch
from settings import Settings
from store.database import Database
from store.queue import JobQueue

_ROUTES = (
    calibrations,
    calibration_checks,
    points,
    surgeries,
    stages,
    stage_results,
    motion,
    legacy_motion,
    radiographs,
    spine,
    measures,
    summary,
    exports,
    plans,
    control_fields,
    jobs,
    changes,
    events,
    session,
    keys,
    audit,
    health,
    metrics,
)
_FORM_LIMITS = {
    "max_files": 2 * max(MAX_SHOTS, MAX_PAIRS) + 8,
    "max_fields": 2 * MAX_PAIRS + 16,
    "max_part_size": MAX_TEXT_PART_BYTES,
}
_DESCRIPTION = """\
Measures stereo pairs of triad markers: labelled triads, and the motion of the vertebrae between stages. Lengths are in
mm, angles in degrees, times in UTC. Pixel coordinates are u to the right and v down; an integer is the centre of a
pixel. Errors are application/problem+json. Spinewatch is not a medical device."""


def create_app(settings: Settings) -> FastAPI:
    """Return the application; it opens its database and queue at startup and closes them at shutdown."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        app.state.database = Database(settings.database_url)
        app.state.queue = JobQueue(settings.queue)
        app.state.key_use = KeyUse(app.state.database)
        app.state.session_duration = timedelta(hours=settings.session_hours)
        app.state.clock_tolerance = timedelta(seconds=settings.clock_tolerance_seconds)
        app.state.reference_pattern = settings.case_number
        app.state.instance = settings.instance_id or uuid4().hex
        app.state.readiness = ReadinessChecks(app.state.database, app.state.queue, settings)
        app.state.metrics = Metrics(app.state.database, app.state.queue, settings, registry)
        app.state.turns = Turns()
        app.state.stopping = asyncio.Event()  # set when the server stops: streams wait for it
        app.state.watch = Watch(app.state.database, app.state.stopping, settings.stream_seconds)
        yield
        app.state.queue.close()
        app.state.database.close()
        app.state.database.checkpoint()

    registry = server_registry()
    app = FastAPIOffline(
        docs_url="/docs",
        redoc_url=None,
        static_url=api_page.FOLDER_PATH,
        title="Spinewatch",
        version=version("spinewatch"),
        description=_DESCRIPTION,
        lifespan=lifespan,
        generate_unique_id_function=_operation_id,
        form_limits=_FORM_LIMITS,
        redirect_slashes=False,
        responses=dict(problem_responses(400, 403, 421, 422)),
    )
    for resource in _ROUTES:
        app.include_router(resource.router)
    dashboard_page.install(app)
    api_page.install(app)
    problems.install(app)
    idempotency.install(app)
    openapi.install(app)
    declared = DeclaredRoutes(route for resource in _ROUTES for route in resource.router.routes)
    _limit_requests(app, settings, declared)
    app.add_middleware(Head)
    app.add_middleware(Refusals, routes=declared)
    # the last one added is the outermost
    app.add_middleware(RequestLog, routes=declared, count=RequestMetrics(registry).add)
    app.add_middleware(Pieces)
    return app


def _limit_requests(app: FastAPI, settings: Settings, declared: DeclaredRoutes) -> None:
    """Refuse requests from headers alone, then bodies while they arrive; the last one added decides first."""
    app.add_middleware(Compression)
    app.add_middleware(JSONCheck)
    app.add_middleware(
        UploadTurns,
        total_bytes=2 * settings.max_upload_bytes,
        max_bytes=settings.max_upload_bytes,
        timeout_s=settings.body_timeout_seconds,
    )
    app.add_middleware(
        BodyLimit,
        max_bytes=lambda scope: max_body_bytes(scope.get(SCOPE_KEY), settings),
        timeout_s=settings.body_timeout_seconds,
    )
    app.add_middleware(DeclaredRequest, routes=declared)
    app.add_middleware(Access, routes=declared)
    origins = settings.listed("allowed_origins")
    app.add_middleware(OwnOrigin, allowed=origins)
    if origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=origins,
            allow_methods=["*"],
            allow_headers=["*"],
            expose_headers=["ETag", "Location", "Retry-After", "X-Request-ID"],
        )
    app.add_middleware(AllowedHosts, names=[settings.host, *settings.listed("allowed_hosts")])


def _operation_id(route: APIRoute) -> str:
    return route.name
