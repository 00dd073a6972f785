"""How long each step of a job takes, from the calls of its progress."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping

_STEPS = frozenset({"decode", "detect", "match", "label", "find targets", "adjust", "assess"})
_OTHER = "other"
_NUMBERED = re.compile(r"^(?P<step>[a-z ]+?)( of shot)? \d+ of \d+$")


class StepClock:
    """Sums the time of each step; a step without a name of its own counts as ``other``."""

    def __init__(self) -> None:
        self._seconds: dict[str, float] = {}
        self._step: str | None = None
        self._since = 0.0

    def begin(self, step: str) -> None:
        """Note that a step begins, which ends the one before.

        Parameters
        ----------
        step
            Its name.
        """
        now = time.monotonic()
        if self._step is not None:
            self._seconds[self._step] = self._seconds.get(self._step, 0.0) + now - self._since
        numbered = _NUMBERED.match(step)
        name = numbered["step"] if numbered else step
        self._step, self._since = name if name in _STEPS else _OTHER, now

    def seconds(self) -> Mapping[str, float]:
        """Return the time of every step until now.

        Returns
        -------
        mapping of str to float
            Time by step, s.
        """
        if self._step is not None:
            self.begin(self._step)
        return self._seconds
