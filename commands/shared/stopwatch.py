"""Times of the steps of a computation, from its progress calls: the library itself reads no clock."""

from __future__ import annotations

from time import perf_counter


class Stopwatch:
    """A ``Progress`` callback that records the time between the starts of steps; a repeated step accumulates."""

    def __init__(self) -> None:
        self._began = self._since = perf_counter()
        self._step: str | None = None
        self._ms: dict[str, float] = {}

    def __call__(self, step: str, fraction: float = 0.0) -> None:
        """End the running step and start ``step``; ``fraction`` is not used."""
        now = perf_counter()
        if self._step is not None:
            self._ms[self._step] = self._ms.get(self._step, 0.0) + (now - self._since) * 1e3
        self._step, self._since = step, now

    def stop(self) -> dict[str, float]:
        """End the running step; return the time of each step and the ``total``, ms."""
        self(self._step or "")
        self._step = None
        return {**self._ms, "total": (self._since - self._began) * 1e3}
