"""Refused requests in the audit: answers 401 and 403, and deletions that were not done."""

from __future__ import annotations

import time
from collections import OrderedDict

import structlog
from anyio import CapacityLimiter, to_thread
from sqlalchemy.exc import SQLAlchemyError
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from contract.event import Actor, ActorKind, Outcome
from service.access import REFUSED, Principal
from service.declared_routes import DeclaredRoutes
from store import events
from store.clock import utc_now
from store.database import Database

WINDOW_SECONDS = 60.0
MAX_OF_ADDRESS = 5
"""Refusals of one address that are recorded within ``WINDOW_SECONDS``; further ones are only counted."""
MAX_OF_ALL = 20
"""Refusals of all addresses that are recorded within ``WINDOW_SECONDS``: 10 MB a day at most."""

_MAX_ADDRESSES = 1024
_MAX_TEXT = 64
_REFUSED = frozenset({401, 403})
_FIRST_ERROR, _FIRST_FAILURE = 400, 500
_log = structlog.get_logger("service")


class Refusals:
    """ASGI middleware that appends an event for a refused request after its answer, at a bounded rate."""

    def __init__(self, app: ASGIApp, routes: DeclaredRoutes) -> None:
        self._app = app
        self._routes = routes
        self._budget = RefusalBudget()
        self._threads = CapacityLimiter(1)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        status = 0

        async def watch(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        await self._app(scope, receive, watch)
        if status in _REFUSED or (scope["method"] == "DELETE" and status >= _FIRST_ERROR):
            await self._record(scope, status)

    async def _record(self, scope: Scope, status: int) -> None:
        address = "unknown" if scope.get("client") is None else str(scope["client"][0])[:_MAX_TEXT]
        unrecorded = self._budget.take(address, time.monotonic())
        if unrecorded is None:
            return
        database: Database = scope["app"].state.database
        try:
            await to_thread.run_sync(
                self._append, database, scope, address, status, unrecorded, limiter=self._threads
            )
        except SQLAlchemyError as error:
            _log.warning("refusal_not_recorded", error=type(error).__name__)

    def _append(self, database: Database, scope: Scope, address: str, status: int, unrecorded: int) -> None:
        state = scope.get("state", {})
        principal: Principal | None = state.get(REFUSED)
        request_id: str | None = state.get("request_id")
        route = self._routes.find(scope["method"], scope["path"])
        detail = f"{scope['method'][:8]} {'unknown path' if route is None else route.path}: {status}"
        if unrecorded:
            detail += f"; {unrecorded} refused before were not recorded"
        actor = Actor(
            kind=ActorKind.HTTP,
            name=address if principal is None else f"{principal.prefix} {principal.name}",
            key=None if principal is None else principal.prefix,
            address=address,
            request_id=request_id,
        )
        with database.write() as session:
            events.append(
                session,
                utc_now(),
                actor,
                events.Action.REQUEST_REFUSED,
                (request_id or "unknown")[:36],
                outcome=Outcome.FAILED if status >= _FIRST_FAILURE else Outcome.REFUSED,
                detail=detail,
            )


class RefusalBudget:
    """Which refusals are recorded, in bounded memory; ``now`` is monotonic."""

    def __init__(self) -> None:
        self._of_address: OrderedDict[str, tuple[float, int]] = OrderedDict()
        self._of_all = (0.0, 0)
        self._unrecorded = 0

    def take(self, address: str, now: float) -> int | None:
        """Return how many refusals were left out since the last one that is recorded; None to leave this one out."""
        started, count = _window(self._of_address.pop(address, (now, 0)), now)
        all_started, all_count = _window(self._of_all, now)
        recorded = count < MAX_OF_ADDRESS and all_count < MAX_OF_ALL
        self._of_address[address] = (started, count + 1)
        if len(self._of_address) > _MAX_ADDRESSES:
            self._of_address.popitem(last=False)
        if not recorded:
            self._unrecorded += 1
            return None
        self._of_all = (all_started, all_count + 1)
        unrecorded, self._unrecorded = self._unrecorded, 0
        return unrecorded


def _window(window: tuple[float, int], now: float) -> tuple[float, int]:
    return (now, 0) if now - window[0] >= WINDOW_SECONDS else window
