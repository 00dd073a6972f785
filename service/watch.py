"""One look at the database every tenth of a second for all clients that wait, whatever their number."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Annotated

import structlog
from anyio import CapacityLimiter, to_thread
from fastapi import Depends, Request
from sqlalchemy.exc import SQLAlchemyError

from contract.change import Change, Changes
from store import changes
from store.changes import Glance
from store.database import Database

_TICK_S = 0.1
_PATIENCE_S = 1.0
"""Time between looks while the database is not available."""
_KEPT = 1000
"""Latest changes in memory, for clients that follow them."""
_log = structlog.get_logger("service")


class Watch:
    """Wakes the clients that wait for changes or for the end of jobs; it looks only while one waits.

    Parameters
    ----------
    database
        The database.
    stopping
        Set when the server stops: all waiting ends.
    """

    def __init__(self, database: Database, stopping: asyncio.Event) -> None:
        self._database = database
        self._stopping = stopping
        self._limiter = CapacityLimiter(1)  # its own: never behind requests that wait for the database
        self._waiting = 0
        self._task: asyncio.Task[None] | None = None
        self._woken = asyncio.Event()
        self._jobs: Counter[str] = Counter()
        self._ended: frozenset[str] = frozenset()
        self._last: int | None = None
        self._known_since = 0
        self._changes: deque[Change] = deque(maxlen=_KEPT)

    @property
    def stopping(self) -> bool:
        """Whether the server stops."""
        return self._stopping.is_set()

    @asynccontextmanager
    async def looking(self) -> AsyncIterator[None]:
        """Look at the database while the context lasts."""
        self._waiting += 1
        if self._task is None:
            self._last = None
            self._task = asyncio.get_running_loop().create_task(self._look_on())
        try:
            yield
        finally:
            self._waiting -= 1

    async def next_look(self, seconds: float) -> None:
        """Wait until something happened, but at most some seconds; within ``looking``."""
        if not self.stopping:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._woken.wait(), seconds)

    async def latest(self) -> int:
        """Return the number of the last event."""
        return await to_thread.run_sync(self._read_last, limiter=self._limiter)

    async def changes_after(self, since: int) -> Changes:
        """Return the changes after a number: from memory, or from the database when they are older."""
        if self._last is not None and self._known_since <= since:
            following = [change for change in self._changes if change.seq > since]
            return Changes(changes=following, last=max(since, self._last), done=True)
        return await to_thread.run_sync(self._read, since, limiter=self._limiter)

    async def job_end(self, job_id: str, seconds: float) -> None:
        """Wait until a job has ended, but at most some seconds."""
        loop = asyncio.get_running_loop()
        end = loop.time() + seconds
        self._jobs[job_id] += 1
        try:
            async with self.looking():
                while job_id not in self._ended and not self.stopping and loop.time() < end:
                    await self.next_look(end - loop.time())
        finally:
            self._jobs[job_id] -= 1
            if not self._jobs[job_id]:
                del self._jobs[job_id]

    async def _look_on(self) -> None:
        """Look until nobody waits or the server stops; every error of the database is waited out."""
        try:
            while self._waiting and not self.stopping:
                delay = _TICK_S
                try:
                    self._note(
                        *await to_thread.run_sync(self._look, tuple(self._jobs), limiter=self._limiter)
                    )
                except SQLAlchemyError as error:
                    _log.warning("watch_interrupted", error=str(getattr(error, "orig", error)))
                    delay = _PATIENCE_S
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._stopping.wait(), delay)
        finally:
            self._task = None
            self._wake()

    def _look(self, jobs: tuple[str, ...]) -> tuple[Glance, Changes | None]:
        """Return what is new; the changes are None at the first look, before which nobody knows where to begin."""
        with self._database.read() as session:
            seen = changes.glance(session, jobs)
            if self._last is None:
                return seen, None
            if seen.last == self._last:
                return seen, Changes(changes=[], last=seen.last, done=True)
            return seen, changes.listed(session, self._last, _KEPT)

    def _note(self, seen: Glance, new: Changes | None) -> None:
        before = self._last
        if new is None:
            self._changes.clear()
            self._last = self._known_since = seen.last
        else:
            for change in new.changes:
                if len(self._changes) == _KEPT:
                    self._known_since = self._changes[0].seq
                self._changes.append(change)
            self._last = new.last
        self._ended = seen.ended
        if self._last != before or seen.ended:
            self._wake()

    def _wake(self) -> None:
        woken, self._woken = self._woken, asyncio.Event()
        woken.set()

    def _read_last(self) -> int:
        with self._database.read() as session:
            return changes.last_number(session)

    def _read(self, since: int) -> Changes:
        with self._database.read() as session:
            return changes.listed(session, since, _KEPT)


def _watch(request: Request) -> Watch:
    watch: Watch = request.app.state.watch
    return watch


WatchDep = Annotated[Watch, Depends(_watch)]
