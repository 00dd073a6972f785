"""Processes that the tests of a session start: found by a variable in their environment, or as descendants."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

_NAME = "STARTED_BY_TESTS"
_PATIENCE_S = 30.0
_OF_PYTHON = ("multiprocessing.resource_tracker", "multiprocessing.forkserver")
"""Helpers of the standard library, which end with this process."""


def mark_children() -> str:
    """Let every process that is started from now on carry a mark, which processes that it starts inherit."""
    os.environ[_NAME] = str(uuid4())
    return f"{_NAME}={os.environ[_NAME]}"


def left_behind(mark: str, patience_s: float = _PATIENCE_S) -> list[str]:
    """Return number and command of the processes that a session has started and that do not end by themselves."""
    end = time.monotonic() + patience_s
    while left := list(_started(mark)):
        if time.monotonic() > end:
            break
        time.sleep(0.1)
    return left


def _started(mark: str) -> Iterator[str]:
    parents: dict[int, int] = {}
    marked: set[int] = set()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, parent = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
            if state in "ZX":
                continue
            parents[int(folder.name)] = int(parent)
            if mark.encode() in (folder / "environ").read_bytes().split(b"\0"):
                marked.add(int(folder.name))
        except (FileNotFoundError, ProcessLookupError, PermissionError):
            continue
    for pid in parents:
        if pid in marked or os.getpid() in _ancestors(pid, parents):
            command = _command(pid)
            if command and not any(name in command for name in _OF_PYTHON):
                yield f"{pid} {command}"


def _ancestors(pid: int, parents: dict[int, int]) -> Iterator[int]:
    while pid in parents:
        pid = parents[pid]
        yield pid


def _command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
    except (FileNotFoundError, ProcessLookupError):
        return ""
