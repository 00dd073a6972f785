"""Text files that the user named, read and written with a named error."""

from __future__ import annotations

from pathlib import Path

from spinewatch.errors import SpinewatchError


class InputError(SpinewatchError):
    """A file that the user named cannot be read."""

    code = "unreadable-file"


class OutputError(SpinewatchError):
    """A result cannot be written where the user asked."""

    code = "unwritable-file"


def read_bytes(path: Path) -> bytes:
    """Return a file's content; raises ``InputError``."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error


def read_text(path: Path) -> str:
    """Return a text file in UTF-8; raises ``InputError``."""
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file") from error


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8; raises ``OutputError``."""
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error
