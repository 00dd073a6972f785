"""JSON bodies are checked before they are decoded, off the event loop."""

from __future__ import annotations

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.declared_routes import SCOPE_KEY, DeclaredRoute
from service.json_check import JSONError, check_json
from service.problems import field_errors, problem, problem_response


class JSONCheck:
    """ASGI middleware that reads a JSON body, refuses what `service.json_check` refuses, and hands the body on."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        route: DeclaredRoute | None = scope.get(SCOPE_KEY)
        if scope["type"] != "http" or route is None or route.media_type != "application/json":
            await self._app(scope, receive, send)
            return
        try:
            body = await _read(receive)
        except ClientDisconnect:
            return
        if body:
            try:
                await run_in_threadpool(check_json, body)
            except JSONError as error:
                entries = [(("body", *place), text, kind) for place, text, kind in error.problems]
                refused = problem(422, str(error), error.code, field_errors(entries))
                response = problem_response(scope, refused)
                await response(scope, receive, send)
                return
        handed_on = False

        async def replayed() -> Message:
            nonlocal handed_on
            if handed_on:
                return await receive()
            handed_on = True
            return {"type": "http.request", "body": body, "more_body": False}

        await self._app(scope, replayed, send)


async def _read(receive: Receive) -> bytes:
    chunks: list[bytes] = []
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            raise ClientDisconnect
        chunks.append(message.get("body", b""))
        if not message.get("more_body", False):
            return b"".join(chunks)
