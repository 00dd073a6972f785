"""How long a process sleeps: time in which none of its threads runs or waits for a core."""

from __future__ import annotations

import os
import time
from pathlib import Path

_PAUSE_S = 0.02


def slept_until_exit_s(pid: int) -> float:
    """Return how long a child that is ending sleeps until its exit, s; other processes' work adds nothing to it.

    It is the time without the time that each thread ran or waited for a core (/proc/PID/schedstat), read until the last
    time that the child was seen alive. The child is left to be reaped.
    """
    began, first = time.monotonic(), _threads(pid)
    busy, slept_s = first, 0.0
    while True:
        now = time.monotonic()
        busy = busy | _threads(pid)
        if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
            return slept_s
        used_s = sum(value - first.get(thread, 0.0) for thread, value in busy.items())
        slept_s = max(now - began - used_s, 0.0)
        time.sleep(_PAUSE_S)


def _threads(pid: int) -> dict[str, float]:
    """Return how long each thread of a process has run and waited for a core, s."""
    found = {}
    for folder in Path(f"/proc/{pid}/task").glob("*"):
        try:
            ran_ns, waited_ns, _ = (folder / "schedstat").read_text().split()
        except (FileNotFoundError, ProcessLookupError):  # it has just ended
            continue
        found[folder.name] = (int(ran_ns) + int(waited_ns)) / 1e9
    return found
