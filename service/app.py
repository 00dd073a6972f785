"""The application: routes, middleware, and the resources that they share."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import timedelta
from importlib.metadata import version

from fastapi import FastAPI
from fastapi.responses import RedirectResponse
from fastapi.routing import APIRoute
from fastapi_offline import FastAPIOffline

from service import openapi, problems
from service.forms.calibration import MAX_SHOTS
from service.middleware.body_limit import BodyLimit
from service.middleware.head import Head
from service.middleware.request_log import RequestLog
from service.routes import calibration_checks, calibrations, health, jobs, motion, stages, surgeries
from settings import Settings
from store.database import Database
from store.queue import JobQueue

_ROUTES = (calibrations, calibration_checks, surgeries, stages, motion, jobs, health)
_FORM_LIMITS = {"max_files": 2 * MAX_SHOTS + 8, "max_fields": 16}
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
        app.state.clock_tolerance = timedelta(seconds=settings.clock_tolerance_seconds)
        yield
        app.state.queue.close()
        app.state.database.close()

    app = FastAPIOffline(
        docs_url="/docs",
        redoc_url=None,
        static_url="/docs/assets",
        title="Spinewatch",
        version=version("spinewatch"),
        description=_DESCRIPTION,
        lifespan=lifespan,
        generate_unique_id_function=_operation_id,
        form_limits=_FORM_LIMITS,
    )
    for resource in _ROUTES:
        app.include_router(resource.router)
    app.add_api_route("/", _redirect_to_docs, include_in_schema=False)
    problems.install(app)
    openapi.install(app)
    app.add_middleware(Head)
    app.add_middleware(BodyLimit, max_bytes=settings.max_upload_bytes)
    app.add_middleware(RequestLog)  # the last one added is the outermost
    return app


def _operation_id(route: APIRoute) -> str:
    return route.name


async def _redirect_to_docs() -> RedirectResponse:
    return RedirectResponse("/docs")
