"""Radiographs are decoded in a process of its own with limits, so that no file can hold or end the server.

The process reads the file from its standard input, limits itself before it looks at it, and answers with a line of JSON
and the PNG. It has no setting and no connection of the server.
"""

from __future__ import annotations

import ctypes
import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, Any

import structlog
from fastapi import HTTPException

from spinewatch.errors import ImageError
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.imaging.radiograph_image import RadiographImage, read_radiograph

MAX_CPU_SECONDS = 20
"""CPU time for a radiograph; the largest ones, of noise, take 6 s."""
MAX_MEMORY_BYTES = 1 << 30
"""Address space for a radiograph; the largest ones take half of it."""
MAX_SECONDS = 120.0
"""Time for a radiograph, however busy the machine."""

_SETTINGS = "SPINEWATCH_"
_MAX_LOGGED = 1000
"""Bytes of what the process says when it breaks that are logged."""
_OUT_OF_MEMORY = 70
"""Exit status of a process that needs more memory than it may have."""
_PR_SET_PDEATHSIG = 1
_log = structlog.get_logger("service")


class RadiographTooCostlyError(ImageError):
    """A radiograph takes more time or memory to decode than it may."""

    code = "radiograph-too-costly"


@dataclass(frozen=True)
class ProcessLimits:
    """What a radiograph may take.

    Attributes
    ----------
    cpu_seconds
        CPU time, s.
    memory_bytes
        Address space, bytes.
    seconds
        Time, s.
    """

    cpu_seconds: int = MAX_CPU_SECONDS
    memory_bytes: int = MAX_MEMORY_BYTES
    seconds: float = MAX_SECONDS


def read_apart(file: IO[bytes], limits: ProcessLimits | None = None) -> RadiographImage:
    """Return a radiograph without the metadata of its file, decoded in a process of its own.

    Parameters
    ----------
    file
        The file: one that has a descriptor, or gets one when it is asked for it.
    limits
        What the process may take; None for the defaults.

    Returns
    -------
    RadiographImage
        Gray levels and pixel spacing.

    Raises
    ------
    ImageError
        The file is no radiograph, with the code of the reason.
    RadiographTooCostlyError
        The file takes more time or memory than it may.
    HTTPException
        503 when the machine is too busy or short of memory, 507 without room for the file.
    """
    allowed = limits or ProcessLimits()
    numbers = [allowed.cpu_seconds, allowed.memory_bytes, os.getpid()]
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(_SETTINGS)}
    try:
        ran = subprocess.run(  # noqa: S603 - our own command
            [sys.executable, "-m", "service.radiograph_process", *map(str, numbers)],
            check=False,
            stdin=_from_start(file),
            capture_output=True,
            timeout=allowed.seconds,
            env={**inherited, "OPENBLAS_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired as error:
        detail = "the radiograph was not decoded in time, because the machine is busy; send it again"
        raise HTTPException(503, detail, {"Retry-After": "10"}) from error
    if ran.returncode != 0:
        log = {"status": ran.returncode, "error": ran.stderr[-_MAX_LOGGED:].decode(errors="replace")}
        _log.warning("radiograph_not_decoded", **log)
        raise _failure(ran.returncode)
    return _result(ran.stdout)


def _failure(status: int) -> Exception:
    """Return why the process ended without an answer."""
    if status in (_OUT_OF_MEMORY, -signal.SIGXCPU):
        return RadiographTooCostlyError(
            "the image takes too much time or memory to decode; export it smaller, or as an uncompressed DICOM file"
        )
    if status == -signal.SIGKILL:
        detail = "the radiograph was not decoded, because the machine is short of memory; send it again"
        return HTTPException(503, detail, {"Retry-After": "10"})
    return ImageError("the image cannot be decoded; export it again, for example as PNG")


def _from_start(file: IO[bytes]) -> int:
    """Return the descriptor of a file, at its start; an upload in memory is written to the disk for it."""
    try:
        descriptor = file.fileno()
    except OSError as error:
        raise HTTPException(
            507, "the upload cannot be stored; make room in the folder TMPDIR of the service"
        ) from error
    os.lseek(descriptor, 0, os.SEEK_SET)
    return descriptor


def _result(answer: bytes) -> RadiographImage:
    """Return what the process answered; raises ``ImageError`` if that is why there is no result."""
    line, _, png = answer.partition(b"\n")
    found: dict[str, Any] = json.loads(line)
    if "code" in found:
        error = ImageError(found["detail"])
        error.code = found["code"]
        raise error
    spacing, source = found["pixel_spacing_mm"], found["spacing_source"]
    return RadiographImage(
        png,
        found["width"],
        found["height"],
        None if spacing is None else (spacing[0], spacing[1]),
        None if source is None else SpacingSource(source),
    )


def _answer(data: bytes) -> Iterator[bytes]:
    """Return what the process answers: a line of JSON and the PNG, or the reason why there is none."""
    try:
        found = read_radiograph(data)
    except ImageError as error:
        yield json.dumps({"code": error.code, "detail": str(error)}).encode() + b"\n"
        return
    document = {
        "width": found.width,
        "height": found.height,
        "pixel_spacing_mm": found.pixel_spacing_mm,
        "spacing_source": found.spacing_source,
    }
    yield json.dumps(document).encode() + b"\n"
    yield found.png


def _end_with(parent: int) -> None:
    """Have Linux end this process with the server, in whatever way that ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        sys.exit(1)


def _main() -> None:
    cpu_seconds, memory_bytes, parent = map(int, sys.argv[1:])
    _end_with(parent)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds + 1))
    resource.setrlimit(resource.RLIMIT_AS, (memory_bytes, memory_bytes))
    try:
        for part in _answer(sys.stdin.buffer.read()):
            sys.stdout.buffer.write(part)
    except MemoryError:
        sys.exit(_OUT_OF_MEMORY)


if __name__ == "__main__":
    _main()
