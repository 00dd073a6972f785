"""Uploads that arrive at once share a bounded memory: further ones wait for their turn."""

from __future__ import annotations

import asyncio
from collections import Counter
from dataclasses import dataclass

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.access import PRINCIPAL
from service.declared_routes import SCOPE_KEY, DeclaredRoute
from service.problems import problem, problem_response

_KEPT = 1 / 4
"""Share of the memory that is kept from large forms and from each single key."""
_SMALL = 1 / 32
"""Share of the memory up to which a form is small: more than a pair of the cart by far."""


@dataclass(eq=False)
class _Form:
    """A form that is read, or waits to be."""

    key: str
    size: int
    turn: asyncio.Future[None]


class UploadTurns:
    """ASGI middleware that lets forms of ``total_bytes`` together be read at once.

    A form whose length is not known counts as one of ``max_bytes``. A form that does not fit waits, unread, and those
    behind it that fit pass it; after ``timeout_s`` it is answered with 503. However slowly the large forms arrive, and
    those of one key, a quarter of the memory is left for small forms, and for other keys.
    """

    def __init__(self, app: ASGIApp, total_bytes: int, max_bytes: int, timeout_s: float) -> None:
        self._app = app
        self._free, self._kept = total_bytes, int(_KEPT * total_bytes)
        self._small = int(_SMALL * total_bytes)
        self._share = total_bytes - self._kept
        self._max_bytes = min(max_bytes, self._share)
        self._timeout_s = timeout_s
        self._held: Counter[str] = Counter()
        self._waiting: list[_Form] = []

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        route: DeclaredRoute | None = scope.get(SCOPE_KEY)
        if scope["type"] != "http" or route is None or route.media_type != "multipart/form-data":
            await self._app(scope, receive, send)
            return
        length = Headers(scope=scope).get("content-length", "")
        principal = scope.get("state", {}).get(PRINCIPAL)
        size = min(int(length), self._max_bytes) if length.isdecimal() else self._max_bytes
        form = _Form(
            "" if principal is None else principal.prefix, size, asyncio.get_running_loop().create_future()
        )
        try:
            async with asyncio.timeout(self._timeout_s):
                await self._take(form)
        except TimeoutError:
            refused = problem(503, "too many uploads arrive at once; send it again")
            response = problem_response(scope, refused, {"Retry-After": "5"})
            await response(scope, receive, send)
            return
        try:
            await self._app(scope, receive, send)
        finally:
            self._give_back(form)

    async def _take(self, form: _Form) -> None:
        """Wait until a form fits."""
        self._waiting.append(form)
        self._grant()
        try:
            await form.turn
        except asyncio.CancelledError:
            if form.turn.cancelled():
                self._waiting.remove(form)
            else:
                self._give_back(form)
            raise

    def _give_back(self, form: _Form) -> None:
        self._free += form.size
        self._held[form.key] -= form.size
        self._held += Counter()  # keys that hold nothing are left out
        self._grant()

    def _grant(self) -> None:
        for form in list(self._waiting):
            if self._fits(form) and not form.turn.cancelled():
                self._waiting.remove(form)
                self._free -= form.size
                self._held[form.key] += form.size
                form.turn.set_result(None)

    def _fits(self, form: _Form) -> bool:
        """Return whether there is room for a form, and for others when it is there."""
        left = self._free - form.size
        is_small = form.size <= self._small
        return left >= (0 if is_small else self._kept) and self._held[form.key] + form.size <= self._share
