"""A limit on the size of request bodies, with and without a Content-Length."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import problem, problem_response


class BodyLimit:
    """ASGI middleware that answers 413 to a request body larger than ``max_bytes``.

    It first reads and discards up to as many bytes again: a client that is still sending would otherwise find its
    connection closed instead of the response.
    """

    def __init__(self, app: ASGIApp, max_bytes: int) -> None:
        self._app = app
        self._max_bytes = max_bytes
        self._detail = f"the request body is larger than {max_bytes} bytes; send the original camera images"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        length = Headers(scope=scope).get("content-length", "0")
        if length.isdecimal() and int(length) > self._max_bytes:
            await self._drain(receive)
            response = problem_response(scope, problem(413, self._detail))
            await response(scope, receive, send)
            return
        await self._app(scope, self._limited(receive), send)

    def _limited(self, receive: Receive) -> Receive:
        """Return a ``receive`` that raises once the body exceeds the limit."""
        received = 0

        async def limited() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > self._max_bytes:
                if message.get("more_body", False):
                    await self._drain(receive)
                raise HTTPException(413, self._detail)
            return message

        return limited

    async def _drain(self, receive: Receive) -> None:
        discarded = 0
        while discarded <= self._max_bytes:
            message = await receive()
            discarded += len(message.get("body", b""))
            if not message.get("more_body", False):
                return
