"""Supervision of child processes: any that ends or is silent is restarted, and none outlives the supervisor."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import structlog

from commands.shared.watchdog import Watchdog

_log = structlog.get_logger("supervisor")

CANNOT_START = 2
"""Exit status of a command that cannot start until its settings or its database change.

It ends the supervisor at the first start; later it means that the database is held or away for a while.
"""

_POLL_SECONDS = 0.1
_FIRST_BACKOFF_SECONDS = 0.5
_MAX_BACKOFF_SECONDS = 10.0
_HEALTHY_SECONDS = 30.0
_STOP_SECONDS = 6.0
_PR_SET_PDEATHSIG = 1


@dataclass
class Child:
    """A supervised process: its name in the log, its command, and its starts (times in s, monotonic clock)."""

    name: str
    command: Sequence[str]
    process: subprocess.Popen[bytes] | None = None
    watchdog: Watchdog | None = None
    started: float = 0.0
    starts: int = 0
    backoff: float = 0.0
    due: float = 0.0


class Supervisor:
    """Starts children, restarts any that end (at once, then with increasing delay), and stops all together.

    A child that has given a sign of life and then none for ``silent_seconds`` is killed: it may hold a lock that all
    others wait for.
    """

    def __init__(
        self, children: Sequence[Child], environment: Mapping[str, str], silent_seconds: float = 20.0
    ) -> None:
        self._children = children
        self._silent_seconds = silent_seconds
        self._environment = {**os.environ, **environment}
        self._stopping = False

    def run(self, on_poll: Callable[[], None]) -> int:
        """Supervise until SIGTERM or SIGINT, calling ``on_poll`` at each poll; return the exit status."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._stop)
        try:
            while not self._stopping:
                if any(self._poll(child) == CANNOT_START and child.starts == 1 for child in self._children):
                    return CANNOT_START
                on_poll()
                time.sleep(_POLL_SECONDS)
        finally:
            self._end_children()
        return 0

    def _stop(self, *_: object) -> None:
        self._stopping = True

    def _poll(self, child: Child) -> int | None:
        """Start a child that is due; return the exit status of one that has ended."""
        now = time.monotonic()
        if child.process is None:
            if now >= child.due:
                self._start(child)
            return None
        if child.watchdog is not None and child.watchdog.is_silent(now):
            _log.error("process_silent", name=child.name, seconds=self._silent_seconds)
            child.process.kill()
            child.process.wait()
        status = child.process.poll()
        if status is not None:
            if child.watchdog is not None:
                child.watchdog.close()
            if now - child.started > _HEALTHY_SECONDS:
                child.backoff = 0.0
            _log.warning("process_ended", name=child.name, status=status, restart_in=child.backoff)
            child.process, child.due = None, now + child.backoff
            child.backoff = min(max(2 * child.backoff, _FIRST_BACKOFF_SECONDS), _MAX_BACKOFF_SECONDS)
        return status

    def _start(self, child: Child) -> None:
        child.watchdog = Watchdog(self._silent_seconds)
        child.process = subprocess.Popen(  # noqa: S603 - our own command
            child.command,
            env={**self._environment, **child.watchdog.environment},
            stdin=subprocess.DEVNULL,
            preexec_fn=die_with_parent,  # noqa: PLW1509 - this process has one thread
        )
        child.started = time.monotonic()
        child.starts += 1

    def _end_children(self) -> None:
        running = [child.process for child in self._children if child.process is not None]
        for process in running:
            process.terminate()
        deadline = time.monotonic() + _STOP_SECONDS
        for process in running:
            try:
                process.wait(max(deadline - time.monotonic(), 0))
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def die_with_parent() -> None:
    """Have Linux send SIGTERM to this process when its parent ends, even if the parent is killed."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
