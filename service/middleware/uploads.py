"""Uploads that arrive at once share a bounded memory: further ones wait for their turn."""

from __future__ import annotations

import asyncio
from collections import deque

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.declared_routes import SCOPE_KEY, DeclaredRoute
from service.problems import problem, problem_response


class UploadTurns:
    """ASGI middleware that lets forms of ``total_bytes`` together be read at once, in order of their arrival.

    A form that waits is not read from the network; after ``timeout_s`` it is answered with 503.
    """

    def __init__(self, app: ASGIApp, total_bytes: int, timeout_s: float) -> None:
        self._app = app
        self._total = self._free = total_bytes
        self._timeout_s = timeout_s
        self._waiting: deque[tuple[int, asyncio.Future[None]]] = deque()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        route: DeclaredRoute | None = scope.get(SCOPE_KEY)
        if scope["type"] != "http" or route is None or route.media_type != "multipart/form-data":
            await self._app(scope, receive, send)
            return
        length = Headers(scope=scope).get("content-length", "")
        size = min(int(length), self._total) if length.isdecimal() else self._total
        try:
            async with asyncio.timeout(self._timeout_s):
                await self._take(size)
        except TimeoutError:
            refused = problem(503, "too many uploads arrive at once; send it again")
            response = problem_response(scope, refused, {"Retry-After": "5"})
            await response(scope, receive, send)
            return
        try:
            await self._app(scope, receive, send)
        finally:
            self._free += size
            self._grant()

    async def _take(self, size: int) -> None:
        """Wait until this many bytes are free and all that came earlier have theirs."""
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.append((size, turn))
        self._grant()
        try:
            await turn
        except asyncio.CancelledError:
            if turn.cancelled():
                self._waiting.remove((size, turn))
            else:
                self._free += size
            self._grant()
            raise

    def _grant(self) -> None:
        while self._waiting and self._waiting[0][0] <= self._free and not self._waiting[0][1].cancelled():
            size, turn = self._waiting.popleft()
            self._free -= size
            turn.set_result(None)
