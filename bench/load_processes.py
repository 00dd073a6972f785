"""Processes of a service under load: their roles, processor time and memory, from /proc (Linux)."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

_PROC = Path("/proc")
_TICKS = os.sysconf("SC_CLK_TCK")
_PAGE = os.sysconf("SC_PAGE_SIZE")
_GONE = (FileNotFoundError, ProcessLookupError, PermissionError)


class Role(StrEnum):
    """What a process of the service is."""

    SUPERVISOR = "supervisor"
    API = "api"
    WORKER = "worker"
    CHILD = "child"


_COMMANDS = {"run": Role.SUPERVISOR, "serve": Role.API, "worker": Role.WORKER}


@dataclass(frozen=True)
class Process:
    """A process at a moment.

    Attributes
    ----------
    pid, parent
        Numbers of the process and of its parent.
    role
        What it is: a process that another one of the service started for its own work is a child.
    cpu_s
        Processor time that it has used, s.
    rss_bytes
        Memory that it occupies.
    """

    pid: int
    parent: int
    role: Role
    cpu_s: float
    rss_bytes: int


def find(mark: str) -> list[Process]:
    """Return the living processes that were started with a variable in their environment, and their descendants."""
    wanted = mark.encode()
    raw = [found for pid in _pids() if (found := _read(pid, wanted)) is not None]
    commands = {pid: command for pid, _, command, *_ in raw}
    return [
        Process(pid, parent, _role(command, commands.get(parent)), cpu_s, rss)
        for pid, parent, command, cpu_s, rss in raw
    ]


def cpu_by_role(processes: Iterable[Process]) -> Mapping[Role, float]:
    """Return the processor time of the processes of each role, s."""
    total = dict.fromkeys(Role, 0.0)
    for process in processes:
        total[process.role] += process.cpu_s
    return total


def kill(pids: Iterable[int]) -> None:
    """End processes at once (SIGKILL)."""
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def _pids() -> Iterator[int]:
    return (int(entry.name) for entry in _PROC.iterdir() if entry.name.isdigit())


def _read(pid: int, mark: bytes) -> tuple[int, int, tuple[str, ...], float, int] | None:
    """Return pid, parent, command, processor time and memory of a process with the mark; None for any other."""
    folder = _PROC / str(pid)
    try:
        if mark not in (folder / "environ").read_bytes().split(b"\0"):
            return None
        command = tuple((folder / "cmdline").read_bytes().decode(errors="replace").split("\0")[:-1])
        fields = (folder / "stat").read_text().rpartition(")")[2].split()
    except _GONE:
        return None
    if fields[0] in "ZX":
        return None
    user, system = int(fields[11]), int(fields[12])
    return pid, int(fields[1]), command, (user + system) / _TICKS, int(fields[21]) * _PAGE


def _role(command: tuple[str, ...], parent: tuple[str, ...] | None) -> Role:
    """Return the role by the command; a process that repeats its parent's command is a fork of it."""
    name = next((part for part in command[1:] if part in _COMMANDS), None)
    return Role.CHILD if name is None or command == parent else _COMMANDS[name]
