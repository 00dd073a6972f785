"""Turns at writing: few requests write at once, so that threads and connections are left for those that read."""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Annotated

from fastapi import Depends, Request

from service.dependencies import AdmissionDep
from service.problems import TooManyWritesError

MAX_WRITERS = 4
"""Requests that write at the same time: the database lets one of them write, the others prepare what they write."""
MAX_WRITE_WAIT_SECONDS = 10.0
"""Time that a request waits for its turn at writing, which is that of a transaction for the database."""


class WriteTurns:
    """The turns of an application, in whose event loop they are taken.

    Requests that wait occupy no thread. Keys take turns: the many requests of one do not delay one of another.

    Parameters
    ----------
    places
        Number of requests that write at the same time.
    wait_s
        Longest time to wait for a turn, s.
    """

    def __init__(self, places: int = MAX_WRITERS, wait_s: float = MAX_WRITE_WAIT_SECONDS) -> None:
        self._free = places
        self._wait_s = wait_s
        self._waiting: OrderedDict[str, deque[asyncio.Future[None]]] = OrderedDict()

    @asynccontextmanager
    async def turn(self, key: str) -> AsyncIterator[None]:
        """Wait for a turn of a key, and have it while the context lasts.

        Raises ``TooManyWritesError`` when no turn came in time.
        """
        await self._take(key)
        try:
            yield
        finally:
            self._give_back()

    async def _take(self, key: str) -> None:
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(key, deque()).append(turn)
        self._grant()
        try:
            async with asyncio.timeout(self._wait_s):
                await turn
        except (TimeoutError, asyncio.CancelledError) as error:
            if turn.cancelled():
                self._leave(key, turn)
            else:  # it came at the same moment
                self._give_back()
            if isinstance(error, TimeoutError):
                raise TooManyWritesError(
                    f"no turn at writing came within {self._wait_s:g} s, for too many requests write at once;"
                    " nothing was stored: send it again"
                ) from error
            raise

    def _give_back(self) -> None:
        self._free += 1
        self._grant()

    def _leave(self, key: str, turn: asyncio.Future[None]) -> None:
        waiting = self._waiting.get(key)
        if waiting is not None and turn in waiting:
            waiting.remove(turn)
            if not waiting:
                del self._waiting[key]

    def _grant(self) -> None:
        """Give what is free to those that have waited longest, to one of each key after the other."""
        while self._free and self._waiting:
            key, waiting = self._waiting.popitem(last=False)
            turn = waiting.popleft()
            if waiting:
                self._waiting[key] = waiting
            if not turn.cancelled():
                self._free -= 1
                turn.set_result(None)


async def _write_turns(request: Request) -> WriteTurns:
    turns: WriteTurns = request.app.state.write_turns
    return turns


WriteTurnsDep = Annotated[WriteTurns, Depends(_write_turns)]


async def _turn(turns: WriteTurnsDep, admission: AdmissionDep) -> AsyncIterator[None]:
    async with turns.turn(admission.key_prefix):
        yield


WriteTurn = Depends(_turn, scope="function")
"""A dependency of routes that write: a turn that is kept until the route has ended, not until its answer is read."""
