"""Limits on the size of a request body and on the time that it takes to arrive."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.declared_routes import SCOPE_KEY
from service.limits import MIN_BODY_RATE
from service.problems import problem, problem_response

_CLOSE = {"Connection": "close"}


class BodyLimit:
    """ASGI middleware that answers 413 to a body that is too large, and 408 to one that comes too slowly.

    A Content-Length beyond the limit is answered before anything is read. What a client still sends after its answer is
    discarded by the connection (`service.connection`).

    Parameters
    ----------
    app
        The application.
    max_bytes
        Returns the largest body of a request from its scope.
    timeout_s
        Time that is waited for a body, extended by a second for each ``MIN_BODY_RATE`` bytes received; the time that
        the application takes does not count.
    """

    def __init__(self, app: ASGIApp, max_bytes: Callable[[Mapping[str, Any]], int], timeout_s: float) -> None:
        self._app = app
        self._max_bytes = max_bytes
        self._timeout_s = timeout_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        limit, started = self._max_bytes(scope), False

        async def send_noting_start(message: Message) -> None:
            nonlocal started
            started = True
            await send(message)

        try:
            length = Headers(scope=scope).get("content-length", "0")
            answered = SCOPE_KEY in scope and scope[SCOPE_KEY] is None  # by the router, with 404 or 405
            if length.isdecimal() and int(length) > limit and not answered:
                raise _too_large(limit)
            await self._app(scope, self._limited(receive, limit), send_noting_start)
        except HTTPException as error:
            if started:
                raise
            refused = problem(error.status_code, str(error.detail))
            response = problem_response(scope, refused, error.headers)
            await response(scope, receive, send)

    def _limited(self, receive: Receive, limit: int) -> Receive:
        """Return a ``receive`` that raises once the body exceeds the limit or is late."""
        received, waited, complete = 0, 0.0, False
        loop = asyncio.get_running_loop()

        async def limited() -> Message:
            nonlocal received, waited, complete
            if complete:
                return await receive()
            began = loop.time()
            try:
                async with asyncio.timeout(self._timeout_s + received / MIN_BODY_RATE - waited):
                    message = await receive()
            except TimeoutError as error:
                raise HTTPException(
                    408, "the request body did not arrive in time; send it again", _CLOSE
                ) from error
            waited += loop.time() - began
            received += len(message.get("body", b""))
            complete = not message.get("more_body", False)
            if received > limit:
                raise _too_large(limit)
            return message

        return limited


def _too_large(limit: int) -> HTTPException:
    return HTTPException(
        413, f"the request body is larger than {limit} bytes, the limit of this path; send less", _CLOSE
    )
