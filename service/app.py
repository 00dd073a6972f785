"""The application: routes, middleware and what they share, made from settings."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.metadata import version

from fastapi import FastAPI
from fastapi.responses import RedirectResponse
from fastapi.routing import APIRoute
from fastapi_offline import FastAPIOffline

from service import problems
from service.forms.calibration import MAX_SHOTS
from service.middleware.body_limit import BodyLimit
from service.middleware.head import Head
from service.middleware.request_log import RequestLog
from service.openapi import describe
from service.routes import calibration_checks, calibrations, health, jobs, motion, stages, surgeries
from settings import Settings
from store.database import Database
from store.queue import JobQueue

_DESCRIPTION = """\
Stereo pairs of triad markers in, labelled triads and the motion of the spine out. Lengths are in mm, angles
in degrees, times in UTC; pixels count u to the right and v down, with whole numbers at pixel centres. Errors
are application/problem+json. Spinewatch is not a medical device."""


def create_app(settings: Settings) -> FastAPI:
    """Return the application; its database is opened when it starts and closed when it ends."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        app.state.record = Database(settings.database_url)
        app.state.bell = JobQueue(settings.queue_file)
        yield
        app.state.bell.close()
        app.state.record.close()

    app = FastAPIOffline(
        docs_url="/docs",
        redoc_url=None,
        static_url="/docs/assets",
        title="Spinewatch",
        version=version("spinewatch"),
        description=_DESCRIPTION,
        lifespan=lifespan,
        generate_unique_id_function=_operation_id,
        form_limits={"max_files": 2 * MAX_SHOTS + 8, "max_fields": 16},
    )
    for room in (calibrations, calibration_checks, surgeries, stages, motion, jobs, health):
        app.include_router(room.router)
    app.add_api_route("/", _to_docs, include_in_schema=False)
    problems.install(app)
    app.add_middleware(Head)
    app.add_middleware(BodyLimit, max_bytes=settings.max_upload_bytes)
    app.add_middleware(RequestLog)
    describe(app)
    return app


def _operation_id(route: APIRoute) -> str:
    return route.name


async def _to_docs() -> RedirectResponse:
    return RedirectResponse("/docs")
