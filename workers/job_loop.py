"""What the process of a worker's jobs does: run one handler after the other, under limits, and answer."""

from __future__ import annotations

import resource
import traceback
from contextlib import suppress
from dataclasses import dataclass
from math import ceil
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import cv2

from spinewatch.errors import SpinewatchError
from spinewatch.progress import Progress
from workers.memory import keep_freed_memory, limit_memory
from workers.registry import FilesWantedError, NotReadyError, Registry

_FIRST_VICTIM = "500"
_NO_MEMORY = -4  # cv2.Error.StsNoMem


@dataclass(frozen=True)
class Progressed:
    """A step begins.

    Attributes
    ----------
    step
        Name of the step.
    fraction
        Fraction of the work done before it, 0 to 1.
    """

    step: str
    fraction: float


@dataclass(frozen=True)
class Returned:
    """The handler returned a result.

    Attributes
    ----------
    result
        The result.
    """

    result: Any


@dataclass(frozen=True)
class Refused:
    """The input cannot be used.

    Attributes
    ----------
    code
        Name of the reason.
    detail
        What is wrong and what to do.
    """

    code: str
    detail: str


@dataclass(frozen=True)
class Waits:
    """The work needs the end of another job.

    Attributes
    ----------
    job_id
        Identifier of the other job.
    """

    job_id: str


@dataclass(frozen=True)
class WantsFiles:
    """The work is to be sent again with more files.

    Attributes
    ----------
    sha256
        SHA-256 of each file, hexadecimal.
    """

    sha256: frozenset[str]


@dataclass(frozen=True)
class OutOfMemory:
    """The process may not have as much memory as the work needs."""


@dataclass(frozen=True)
class Broke:
    """The handler raised an error that has no name.

    Attributes
    ----------
    report
        The traceback.
    """

    report: str


Answer = Returned | Refused | Waits | WantsFiles | OutOfMemory | Broke


def run_jobs(connection: Connection, registry: Registry, memory_bytes: int, cpu_seconds: float) -> None:
    """Run the handlers that the worker asks for, until it closes the connection.

    Parameters
    ----------
    connection
        Connection to the worker: it sends the kind of a job and its input; ``Progressed`` and an ``Answer`` go back.
    registry
        Handlers by kind of job.
    memory_bytes
        Largest address space, bytes.
    cpu_seconds
        Largest CPU time of a job, s; the process is ended beyond it.
    """
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    limit_memory(memory_bytes)
    keep_freed_memory()
    with suppress(
        OSError
    ):  # when the machine's memory runs out, the kernel ends this process and not the service
        Path("/proc/self/oom_score_adj").write_text(_FIRST_VICTIM, encoding="ascii")

    def progress(step: str, fraction: float) -> None:
        connection.send(Progressed(step, fraction))

    while True:
        try:
            kind, work = connection.recv()
        except EOFError:
            return
        _limit_cpu(cpu_seconds)
        answer = _answer(registry, kind, work, progress)
        del work
        connection.send(answer)


def _answer(registry: Registry, kind: str, work: Any, progress: Progress) -> Answer:
    try:
        handler = registry.handler(kind)
        return Returned(handler.pack(handler.run(work, progress)))
    except SpinewatchError as error:
        return Refused(error.code, str(error))
    except NotReadyError as error:
        return Waits(error.job_id)
    except FilesWantedError as error:
        return WantsFiles(error.sha256)
    except Exception as error:
        return OutOfMemory() if _is_out_of_memory(error) else Broke(traceback.format_exc())


def _is_out_of_memory(error: Exception) -> bool:
    return isinstance(error, MemoryError) or (isinstance(error, cv2.error) and error.code == _NO_MEMORY)


def _limit_cpu(seconds: float) -> None:
    """Limit the CPU time of the next job; the system counts that of the process since its start."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    limit = ceil(used.ru_utime + used.ru_stime + seconds)
    resource.setrlimit(
        resource.RLIMIT_CPU, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard)
    )
