"""One look at the database for all clients that wait, whatever their number, soon after each event."""

from __future__ import annotations

import asyncio
import time
from collections import Counter, deque
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress
from math import inf
from typing import Annotated

import structlog
from anyio import CapacityLimiter, to_thread
from fastapi import Depends, Request
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from contract.change import Change, Changes
from service.dependencies import AdmissionDep
from service.problems import AccessEndedError, TooManyWaitingError
from store import admissions as admitted
from store import changes
from store.admissions import Admission
from store.changes import Glance
from store.clock import utc_now
from store.database import Database

_TICK_S = 0.004
"""Time between two questions whether an event was committed."""
_BLIND_TICK_S = 0.05
"""Time between looks at a database that does not tell."""
_LONGEST_S = 1.0
"""Longest time between two looks."""
_PATIENCE_S = 1.0
"""Time between looks while the database is not available."""
_ADMISSION_S = 1.0
"""Time after which it is looked whether all are still admitted, when nothing has happened: keys and sessions expire."""
_NOT_ADMITTED = "the API key was revoked or has expired, or the session has ended; send a valid key"
MAX_WAITING = 50
"""Streams and requests with ``wait`` of one key at once; each has a connection for as long as it lasts."""
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
    stream_seconds
        Time after which a stream ends, s.
    """

    def __init__(self, database: Database, stopping: asyncio.Event, stream_seconds: float = inf) -> None:
        self.stream_seconds = stream_seconds
        self._database = database
        self._commits = database.commits()
        self._stopping = stopping
        self._limiter = CapacityLimiter(1)  # its own: never behind requests that wait for the database
        self._followers = 0
        self._asked = False
        self._task: asyncio.Task[None] | None = None
        self._woken = asyncio.Event()
        self._jobs: Counter[str] = Counter()
        self._ended: frozenset[str] = frozenset()
        self._admissions: Counter[Admission] = Counter()
        self._places: Counter[str] = Counter()
        self._withdrawn: frozenset[Admission] = frozenset()
        self._admitted_at = -inf
        self._last: int | None = None
        self._known_since = 0
        self._changes: deque[Change] = deque(maxlen=_KEPT)

    @property
    def stopping(self) -> bool:
        """Whether the server stops."""
        return self._stopping.is_set()

    def is_withdrawn(self, admission: Admission) -> bool:
        """Return whether the key or the session of a client is no longer valid; within ``looking``."""
        return admission in self._withdrawn

    @contextmanager
    def place(self, admission: Admission) -> Iterator[None]:
        """Have a place for a client that waits; raises ``TooManyWaitingError`` when its key has no more of them."""
        key = admission.key_prefix
        if self._places[key] >= MAX_WAITING:
            raise TooManyWaitingError(
                f"the key {key} has {MAX_WAITING} streams and waiting requests open, which is the most; close those"
                " that nobody reads, or use another key"
            )
        self._places[key] += 1
        try:
            yield
        finally:
            self._places[key] -= 1
            if not self._places[key]:
                del self._places[key]

    @asynccontextmanager
    async def looking(self, admission: Admission) -> AsyncIterator[None]:
        """Look at the changes while the context lasts, also whether a client is still admitted."""
        if not self._followers:
            self._last = None
        self._followers += 1
        try:
            with self._waiting(admission):
                yield
        finally:
            self._followers -= 1

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

    async def job_end(self, job_id: str, seconds: float, admission: Admission) -> None:
        """Wait until a job has ended, but at most some seconds; raises ``AccessEndedError`` when access ends before."""
        loop = asyncio.get_running_loop()
        end = loop.time() + seconds
        self._jobs[job_id] += 1
        try:
            with self.place(admission), self._waiting(admission):
                while job_id not in self._ended and not self.stopping and loop.time() < end:
                    await self.next_look(end - loop.time())
                    if self.is_withdrawn(admission):
                        raise AccessEndedError(_NOT_ADMITTED)
        finally:
            self._jobs[job_id] -= 1
            if not self._jobs[job_id]:
                del self._jobs[job_id]

    @contextmanager
    def _waiting(self, admission: Admission) -> Iterator[None]:
        """Look at the database at once, and after each event while the context lasts."""
        self._admissions[admission] += 1
        self._asked = True
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._look_on())
        try:
            yield
        finally:
            self._admissions[admission] -= 1
            if not self._admissions[admission]:
                del self._admissions[admission]

    async def _look_on(self) -> None:
        """Look until nobody waits or the server stops; every error of the database is waited out."""
        loop = asyncio.get_running_loop()
        tick = _TICK_S if self._commits.are_seen else _BLIND_TICK_S
        looked = -inf
        try:
            while self._admissions and not self.stopping:
                if self._commits.happened() or self._asked or loop.time() - looked > _LONGEST_S:
                    looked, self._asked = loop.time(), False
                    wanted = tuple(self._jobs), tuple(self._admissions), self._followers > 0
                    try:
                        self._note(*await to_thread.run_sync(self._look, *wanted, limiter=self._limiter))
                    except SQLAlchemyError as error:
                        _log.warning("watch_interrupted", error=str(getattr(error, "orig", error)))
                        self._asked = True
                        with suppress(TimeoutError):
                            await asyncio.wait_for(self._stopping.wait(), _PATIENCE_S)
                await asyncio.sleep(tick)
        finally:
            self._task = None
            self._commits.close()
            self._wake()

    def _look(
        self, jobs: tuple[str, ...], admissions: tuple[Admission, ...], follows: bool
    ) -> tuple[Glance, Changes | None, frozenset[Admission] | None]:
        """Return what is new: of changes None at the first look, of admissions None unless there may be something."""
        with self._database.read() as session:
            seen = changes.glance(session, jobs)
            withdrawn = None
            if self._has_to_admit(session, seen.last):
                withdrawn = admitted.withdrawn(session, admissions, utc_now())
                self._admitted_at = time.monotonic()
            if self._last is None or not follows:
                return seen, None, withdrawn
            if seen.last == self._last:
                return seen, Changes(changes=[], last=seen.last, done=True), withdrawn
            return seen, changes.listed(session, self._last, _KEPT), withdrawn

    def _has_to_admit(self, session: Session, last: int) -> bool:
        """Return whether a key or a session may have become invalid since the last look at them."""
        if self._last is None or time.monotonic() - self._admitted_at > _ADMISSION_S:
            return True
        return last != self._last and changes.of_access(session, self._last)

    def _note(self, seen: Glance, new: Changes | None, withdrawn: frozenset[Admission] | None) -> None:
        before = self._last
        if withdrawn is not None:
            self._withdrawn = withdrawn
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
        if seen.ended or withdrawn or (self._followers and self._last != before):
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


async def _watch(request: Request) -> Watch:
    watch: Watch = request.app.state.watch
    return watch


WatchDep = Annotated[Watch, Depends(_watch)]


async def _place(watch: WatchDep, admission: AdmissionDep) -> AsyncIterator[None]:
    with watch.place(admission):
        yield


StreamPlace = Depends(_place)
"""A dependency of routes that stream: a place that is kept until the stream has ended, or 429 before it begins."""
