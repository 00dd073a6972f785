"""One run of a blocking action for all that ask at about the same time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Generic, TypeVar

Result = TypeVar("Result")


class SharedRun(Generic[Result]):
    """Runs an action in a thread; its result serves all that ask meanwhile and for ``kept_seconds`` after.

    However many ask, they occupy one thread.
    """

    def __init__(self, action: Callable[[], Result], kept_seconds: float) -> None:
        self._action = action
        self._kept_seconds = kept_seconds
        self._run: asyncio.Task[Result] | None = None
        self._ended = 0.0

    async def result(self) -> Result:
        """Return the result of a run that has not ended, or ended a short time ago; raises what the action raises."""
        run = self._run
        if run is None or (run.done() and time.monotonic() - self._ended > self._kept_seconds):
            run = self._run = asyncio.create_task(asyncio.to_thread(self._timed))
        return await asyncio.shield(run)

    def _timed(self) -> Result:
        try:
            return self._action()
        finally:
            self._ended = time.monotonic()
