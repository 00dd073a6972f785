"""Actions that are repeated in a thread of their own."""

from __future__ import annotations

import threading
from collections.abc import Callable

import structlog

from store.unavailable import is_unavailable

_log = structlog.get_logger("worker")


def start_periodic(name: str, seconds: float, stop: threading.Event, action: Callable[[], object]) -> None:
    """Repeat an action in a thread; an error is logged and the next round follows.

    Parameters
    ----------
    name
        Name of the thread.
    seconds
        Time between two rounds.
    stop
        Ends the thread when it is set.
    action
        Called in each round.
    """

    def loop() -> None:
        while not stop.wait(seconds):
            try:
                action()
            except Exception as error:  # the next round repeats it
                if isinstance(error, OSError) or is_unavailable(error):  # one line: it may fail for hours
                    cause = str(getattr(error, "orig", error)).partition("\n")[0]
                    _log.error("round_failed", thread=name, error=cause)
                else:
                    _log.exception("round_failed", thread=name)

    threading.Thread(target=loop, name=name, daemon=True).start()
