"""Keeps child processes alive, and lets none outlive it."""

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

_log = structlog.get_logger("supervisor")

REFUSED = 2
"""The exit status of a command that cannot start as things are; starting it again would not help."""

_PAUSE_SECONDS = 0.1
_LONGEST_BACKOFF_SECONDS = 10.0
_HEALTHY_SECONDS = 30.0
_STOP_SECONDS = 6.0
_PR_SET_PDEATHSIG = 1


@dataclass
class Child:
    """A process that is to run: its name in the log, its command, and how its last lives went."""

    name: str
    command: Sequence[str]
    process: subprocess.Popen[bytes] | None = None
    started: float = 0.0
    backoff: float = 0.0
    due: float = 0.0


class Supervisor:
    """Starts children, restarts the dead (at once, then ever later), and stops all together."""

    def __init__(self, children: Sequence[Child], environment: Mapping[str, str]) -> None:
        self._children = children
        self._environment = {**os.environ, **environment}
        self._stopping = False

    def run(self, each_round: Callable[[], None]) -> int:
        """Watch until SIGTERM or SIGINT, calling ``each_round`` often; return the exit status."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._stop)
        status = 0
        try:
            while not self._stopping:
                if any(self._watch(child) == REFUSED for child in self._children):
                    status = REFUSED
                    break
                each_round()
                time.sleep(_PAUSE_SECONDS)
        finally:
            self._end()
        return status

    def _stop(self, *_: object) -> None:
        self._stopping = True

    def _watch(self, child: Child) -> int | None:
        now = time.monotonic()
        if child.process is None:
            if now >= child.due:
                self._start(child)
            return None
        status = child.process.poll()
        if status is not None:
            if now - child.started > _HEALTHY_SECONDS:
                child.backoff = 0.0
            _log.warning("process_died", name=child.name, status=status, restart_in=child.backoff)
            child.process, child.due = None, now + child.backoff
            child.backoff = min(max(2 * child.backoff, 0.5), _LONGEST_BACKOFF_SECONDS)
        return status

    def _start(self, child: Child) -> None:
        child.process = subprocess.Popen(  # noqa: S603 - our own command
            child.command,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            preexec_fn=_die_with_parent,  # noqa: PLW1509 - this process has one thread
        )
        child.started = time.monotonic()

    def _end(self) -> None:
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


def _die_with_parent() -> None:
    """Ask Linux to end this process in good order when its parent is gone, however it went."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
