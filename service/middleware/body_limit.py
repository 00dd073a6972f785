"""No request body above a size, whether it says its length or comes in chunks."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.problems import problem, problem_response


class BodyLimit:
    """ASGI middleware that answers 413 to a body of more than ``max_bytes``.

    As much again is read and thrown away first, since a client that is still sending would see its connection
    break instead of the answer.
    """

    def __init__(self, app: ASGIApp, max_bytes: int) -> None:
        self._app = app
        self._max_bytes = max_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        length = Headers(scope=scope).get("content-length", "0")
        if length.isdecimal() and int(length) > self._max_bytes:
            await self._drain(receive)
            response = problem_response(scope, problem(413, self._sentence))
            await response(scope, receive, send)
            return
        await self._app(scope, self._counted(receive), send)

    def _counted(self, receive: Receive) -> Receive:
        seen = 0

        async def counted() -> Message:
            nonlocal seen
            message = await receive()
            seen += len(message.get("body", b""))
            if seen > self._max_bytes:
                if message.get("more_body", False):
                    await self._drain(receive)
                raise HTTPException(413, self._sentence)
            return message

        return counted

    async def _drain(self, receive: Receive) -> None:
        seen = 0
        while seen <= self._max_bytes:
            message = await receive()
            seen += len(message.get("body", b""))
            if not message.get("more_body", False):
                return

    @property
    def _sentence(self) -> str:
        return f"the request body is larger than {self._max_bytes} bytes; send the camera's own frames"
