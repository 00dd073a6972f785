"""A request identifier and one log line per request; unexpected errors are logged and answered with 500."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from uuid import uuid4

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.declared_routes import DeclaredRoutes
from service.problems import problem, problem_response

_HEADER = "X-Request-ID"
_VALID_ID = re.compile(r"[\w-]{1,64}", re.ASCII)
_log = structlog.get_logger("service")


Count = Callable[[str, str | None, int, float], None]
"""Called after each request with its method, declared path (None without a route), status and time, s."""

_POLLED = frozenset(
    {
        "/health/live",
        "/health/ready",
        "/metrics",
        "/v1/changes",
        "/v1/events",
        "/v1/health",
        "/v1/jobs",
        "/v1/jobs/{job_id}",
    }
)
"""Paths that programs ask for again and again; an answer without an error is logged as debug only."""

_FIRST_ERROR = 400


class RequestLog:
    """ASGI middleware, the outermost; a log line has method, path, status and time, never a body or a query."""

    def __init__(
        self, app: ASGIApp, routes: DeclaredRoutes | None = None, count: Count | None = None
    ) -> None:
        self._app = app
        self._routes = routes
        self._count = count

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        sent_id = Headers(scope=scope).get(_HEADER, "")
        request_id = sent_id if _VALID_ID.fullmatch(sent_id) else str(uuid4())
        scope.setdefault("state", {})["request_id"] = request_id
        # Escaped as it was sent, so that no path begins a line of the log.
        path = scope.get("raw_path", b"").decode("ascii", "replace")
        started, status = time.perf_counter(), 0

        async def send_with_id(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[_HEADER] = request_id
            await send(message)

        with structlog.contextvars.bound_contextvars(request_id=request_id):
            try:
                await self._app(scope, receive, send_with_id)
            except ClientDisconnect:  # there is nobody to answer
                pass
            except Exception:
                _log.exception("unexpected_error", method=scope["method"], path=path)
                if status:  # the response has started and cannot be replaced
                    raise
                detail = f"an unexpected error occurred; the log has it under request {request_id}"
                response = problem_response(scope, problem(500, detail))
                await response(scope, receive, send_with_id)
            seconds = time.perf_counter() - started
            route = None if self._routes is None else self._routes.template(scope["path"])
            if self._count is not None:
                self._count(scope["method"], route, status, seconds)
            polls = scope["method"] in {"GET", "HEAD"} and route in _POLLED and 0 < status < _FIRST_ERROR
            log = _log.debug if polls else _log.info
            log("request", method=scope["method"], path=path, status=status, ms=round(seconds * 1000, 1))
