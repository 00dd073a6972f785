"""Turns of requests at something that few do at once: each key has one after the other."""

from __future__ import annotations

import asyncio
from collections import OrderedDict, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from spinewatch.errors import SpinewatchError


class TooBusyError(SpinewatchError):
    """No turn of a request came in time."""

    code = "too-busy"


class KeyTurns:
    """Turns, which are taken in the event loop of an application.

    Requests that wait occupy no thread. Keys take turns: the many requests of one do not delay one of another.

    Parameters
    ----------
    places
        Number of requests that have a turn at the same time.
    wait_s
        Longest time to wait for a turn, s.
    """

    def __init__(self, places: int, wait_s: float) -> None:
        self._free = places
        self._wait_s = wait_s
        self._waiting: OrderedDict[str, deque[asyncio.Future[None]]] = OrderedDict()

    @asynccontextmanager
    async def turn(self, key: str) -> AsyncIterator[None]:
        """Wait for a turn of a key, and have it while the context lasts.

        Raises ``TooBusyError`` when no turn came in time.
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
                raise TooBusyError(
                    f"too many requests of this kind come at once, and no turn came within {self._wait_s:g} s; nothing"
                    " was done: send it again"
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
