"""Standard output that is full or closed, as a named error."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedWriter, FileIO, TextIOWrapper, UnsupportedOperation
from typing import TYPE_CHECKING, TextIO

from commands.shared.files import OutputError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_STDOUT = 1


class _NamedFile(FileIO):
    """A file descriptor whose errors are named; a pipe that nobody reads is left to who started the command."""

    def write(self, content: ReadableBuffer, /) -> int:
        try:
            return super().write(content)
        except BrokenPipeError:
            raise
        except OSError as error:
            raise OutputError(
                f"cannot write the output: {error.strerror}; free space, or send it elsewhere"
            ) from error


@contextmanager
def standard_output() -> Iterator[None]:
    """Write everything that is printed before this ends; raises ``OutputError`` if that is impossible.

    ``BrokenPipeError`` means that whoever read the output has ended.
    """
    if sys.stdout is None:
        raise OutputError("standard output is closed; send it to a file, or to /dev/null")
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")  # names of files may have bytes that are no text
    if sys.stdout is sys.__stdout__ and isinstance(sys.stdout, TextIOWrapper):
        sys.stdout = _named(sys.stdout)
    is_of_process = _is_of_process(sys.stdout)
    try:
        yield
        sys.stdout.flush()
    except (OutputError, BrokenPipeError):
        if is_of_process:
            _drop_output()
        raise


def _named(stream: TextIOWrapper) -> TextIOWrapper:
    stream.flush()
    return TextIOWrapper(
        BufferedWriter(_NamedFile(_STDOUT, "wb", closefd=False)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def _is_of_process(stream: TextIO) -> bool:
    """Return whether what is printed goes to the output of the process, and not to a program that calls a command."""
    try:
        return stream.fileno() == _STDOUT
    except UnsupportedOperation:
        return False


def _drop_output() -> None:
    """Let the end of the process write what is left of the output to nowhere."""
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, _STDOUT)
        os.close(nowhere)
