"""A request identifier and one log line per request; unexpected errors are logged and answered with 500."""

from __future__ import annotations

import re
import time
from uuid import uuid4

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import problem, problem_response

_HEADER = "X-Request-ID"
_VALID_ID = re.compile(r"[\w-]{1,64}", re.ASCII)
_log = structlog.get_logger("service")


class RequestLog:
    """ASGI middleware, the outermost; a log line has method, path, status and time, never a body or a query."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        sent_id = Headers(scope=scope).get(_HEADER, "")
        request_id = sent_id if _VALID_ID.fullmatch(sent_id) else str(uuid4())
        scope.setdefault("state", {})["request_id"] = request_id
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
            except Exception:
                _log.exception("unexpected_error", method=scope["method"], path=scope["path"])
                if status:  # the response has started and cannot be replaced
                    raise
                detail = f"an unexpected error occurred; the log has it under request {request_id}"
                response = problem_response(scope, problem(500, detail))
                await response(scope, receive, send_with_id)
            ms = round((time.perf_counter() - started) * 1000, 1)
            _log.info("request", method=scope["method"], path=scope["path"], status=status, ms=ms)
