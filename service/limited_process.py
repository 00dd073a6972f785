"""Work that may cost much runs in a process of its own with limits, so that no request can hold or end the server.

The process reads its standard input, limits itself before it looks at it, and answers into a temporary file. It has no
setting and no connection of the server, and ends with it.
"""

from __future__ import annotations

import ctypes
import errno
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import structlog
from starlette.exceptions import HTTPException

_SETTINGS = "SPINEWATCH_"
_MAX_LOGGED = 1000
"""Bytes of what a process says when it breaks that are logged."""
_OUT_OF_MEMORY = 70
"""Exit status of a process that needs more memory than it may have."""
_NO_ROOM = 74
"""Exit status of a process whose answer has no room on the disk."""
_COSTLY = frozenset({_OUT_OF_MEMORY, -signal.SIGXCPU, -signal.SIGABRT, -signal.SIGTRAP})
"""How a process ends that takes too much; libraries that get no memory abort, GLib with a trap."""
_PR_SET_PDEATHSIG = 1
_log = structlog.get_logger("service")

Answer = Callable[[bytes, Sequence[str]], Iterable[bytes]]
"""What a process does: the parts of its answer, from its input and its arguments."""


class TooCostlyError(Exception):
    """The work takes more CPU time or memory than it may."""


class NoAnswerError(Exception):
    """The process broke."""


@dataclass(frozen=True)
class ProcessLimits:
    """What a process may take.

    Attributes
    ----------
    cpu_seconds
        CPU time, s.
    memory_bytes
        Address space, bytes.
    seconds
        Time, s, however busy the machine.
    """

    cpu_seconds: int
    memory_bytes: int
    seconds: float


def answer_of(module: str, arguments: Sequence[str], source: IO[bytes], limits: ProcessLimits) -> IO[bytes]:
    """Run a module that calls ``serve`` in a process of its own, and return its answer.

    Parameters
    ----------
    module
        Name of the module.
    arguments
        What it gets besides the source.
    source
        Its input: a file that has a descriptor, or gets one when it is asked for it.
    limits
        What the process may take.

    Returns
    -------
    file
        The answer, at its start; a file without a name, which is gone when it is closed.

    Raises
    ------
    TooCostlyError
        The process took more CPU time or memory than it may.
    NoAnswerError
        The process broke.
    HTTPException
        503 when the machine is too busy or short of memory, 507 without room for the input or the answer.
    """
    numbers = [limits.cpu_seconds, limits.memory_bytes, os.getpid()]
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(_SETTINGS)}
    answer = _temporary()
    try:
        ran = subprocess.run(  # noqa: S603 - our own command
            [sys.executable, "-P", "-m", module, *map(str, numbers), *arguments],
            check=False,
            stdin=_from_start(source),
            stdout=answer,
            stderr=subprocess.PIPE,
            timeout=limits.seconds,
            env={**inherited, "OPENBLAS_NUM_THREADS": "1"},
        )
        if ran.returncode != 0:
            log = {"status": ran.returncode, "error": ran.stderr[-_MAX_LOGGED:].decode(errors="replace")}
            _log.warning("process_without_answer", module=module, **log)
            raise _failure(ran.returncode)
    except subprocess.TimeoutExpired as error:
        answer.close()
        raise _busy("was not done in time, because the machine is busy") from error
    except BaseException:
        answer.close()
        raise
    answer.seek(0)
    return answer


def stored(parts: Iterable[bytes]) -> IO[bytes]:
    """Return a temporary file of some bytes, for the input of a process.

    Parameters
    ----------
    parts
        The bytes.

    Returns
    -------
    file
        The file, which is gone when it is closed.

    Raises
    ------
    HTTPException
        507 without room for it.
    """
    file = _temporary()
    try:
        file.writelines(parts)
        file.seek(0)
    except OSError as error:
        file.close()
        raise _no_room() from error
    return file


def serve(answer: Answer) -> None:
    """Limit this process, which ``answer_of`` has started, and write its answer.

    Parameters
    ----------
    answer
        What the process does.
    """
    cpu_seconds, memory_bytes, parent = map(int, sys.argv[1:4])
    _end_with(parent)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 1))
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    try:
        with os.fdopen(os.dup(1), "wb") as file:
            os.dup2(2, 1)  # what a library prints is no answer
            file.writelines(answer(sys.stdin.buffer.read(), sys.argv[4:]))
    except MemoryError:
        os._exit(_OUT_OF_MEMORY)
    except OSError as error:
        if error.errno not in {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}:
            raise
        os._exit(_NO_ROOM)


def _failure(status: int) -> Exception:
    """Return why a process ended without an answer."""
    if status in _COSTLY:
        return TooCostlyError()
    if status == _NO_ROOM:
        return _no_room()
    if status == -signal.SIGKILL:
        return _busy("was not done, because the machine is short of memory")
    return NoAnswerError()


def _busy(what: str) -> HTTPException:
    return HTTPException(503, f"the request {what}; send it again", {"Retry-After": "10"})


def _no_room() -> HTTPException:
    return HTTPException(507, "the file cannot be stored; make room in the folder TMPDIR of the service")


def _temporary() -> IO[bytes]:
    try:
        return TemporaryFile()
    except OSError as error:
        raise _no_room() from error


def _from_start(file: IO[bytes]) -> int:
    """Return the descriptor of a file, at its start; an upload in memory is written to the disk for it."""
    try:
        descriptor = file.fileno()
    except OSError as error:
        raise _no_room() from error
    os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor


def _end_with(parent: int) -> None:
    """Have Linux end this process with the server, in whatever way that ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        Path("/proc/self/oom_score_adj").write_text("1000")  # it is ended before the server is
    if os.getppid() != parent:
        sys.exit(1)
