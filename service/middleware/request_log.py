"""One identifier and one log line a request; an unexpected error is logged here and answered with 500."""

from __future__ import annotations

import re
import time
from uuid import uuid4

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import problem, problem_response

_HEADER = "X-Request-ID"
_USABLE = re.compile(r"[\w-]{1,64}", re.ASCII)
_log = structlog.get_logger("service")


class RequestLog:
    """ASGI middleware, the outermost: the line has method, path, status and time, never a body or a query."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(_HEADER, "")
        request_id = given if _USABLE.fullmatch(given) else str(uuid4())
        scope.setdefault("state", {})["request_id"] = request_id
        started, status = time.perf_counter(), 0

        async def send_named(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[_HEADER] = request_id
            await send(message)

        with structlog.contextvars.bound_contextvars(request_id=request_id):
            try:
                await self._app(scope, receive, send_named)
            except Exception:
                _log.exception("unexpected_error", method=scope["method"], path=scope["path"])
                if status:
                    raise
                detail = f"something unexpected happened; the log has it under request {request_id}"
                response = problem_response(scope, problem(500, detail))
                await response(scope, receive, send_named)
            ms = round((time.perf_counter() - started) * 1000, 1)
            _log.info("request", method=scope["method"], path=scope["path"], status=status, ms=ms)
