"""Files named on the command line, read and written with named errors."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from spinewatch.errors import SpinewatchError
from store.regular_file import MAX_DOCUMENT_BYTES, MAX_IMAGE_BYTES, read_regular


class InputError(SpinewatchError):
    """A file cannot be read."""

    code = "unreadable-file"


class OutputError(SpinewatchError):
    """A file cannot be written."""

    code = "unwritable-file"


def read_bytes(path: Path) -> bytes:
    """Return the content of a file of a document; raises ``InputError``, also for a device or pipe."""
    return _read(path, MAX_DOCUMENT_BYTES)


def read_image(path: Path) -> bytes:
    """Return the content of a file of an image; raises ``InputError``, also for a device or pipe."""
    return _read(path, MAX_IMAGE_BYTES)


def read_text(path: Path) -> str:
    """Return the content of a UTF-8 text file; raises ``InputError``."""
    try:
        return read_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path} is not a text file in UTF-8") from error


def read_json(path: Path) -> Any:
    """Return the content of a JSON file; raises ``InputError``."""
    try:
        return json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is not JSON") from error


def make_folder(path: Path) -> None:
    """Create a folder and those above it, if missing; raises ``OutputError``."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot create {path}: {error.strerror}") from error


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file; raises ``OutputError``."""
    try:
        path.write_bytes(content)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror}") from error


def printable_name(name: str) -> str:
    """Return a name as text that can be printed and stored: bytes that are not UTF-8 are escaped."""
    return os.fsencode(name).decode("utf-8", "backslashreplace")


def require_ending(path: Path, endings: Sequence[str], contents: str) -> None:
    """Raise ``OutputError`` for a file whose ending says that it holds something else; devices have none.

    ``contents`` names what would be written.
    """
    # Of a name that is too long, the methods of Path raise.
    if path.suffix.lower() not in endings and (os.path.isfile(path) or not os.path.exists(path)):
        *others, last = [ending or "no ending" for ending in endings]
        known = f"{', '.join(others)} or {last}" if others else last
        raise OutputError(f"{path} cannot hold {contents}; give a name with {known}")


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file; raises ``OutputError``."""
    write_bytes(path, text.encode("utf-8"))


def _read(path: Path, max_bytes: int) -> bytes:
    """Return the content of a regular file up to a size; raises ``InputError``."""
    try:
        return read_regular(path, max_bytes)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
