"""Files that somebody named: read only when they are regular files, and only up to a limit."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

MAX_DOCUMENT_BYTES = 64 * 1024 * 1024
"""Largest file of a document, table, certificate or template set, bytes."""

MAX_IMAGE_BYTES = 512 * 1024 * 1024
"""Largest file of an image, bytes: one of 64 million pixels has 384 million in three channels of 16 bits."""


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file to read.

    A device or a pipe may never end, and opening one may wait without end or do something.

    Parameters
    ----------
    path
        The file, or a link to it.

    Returns
    -------
    BinaryIO
        Its bytes.

    Raises
    ------
    OSError
        It cannot be read, or is a folder, device, pipe or socket; ``strerror`` says which.
    """
    mode = path.stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # a folder has an error of its own
        raise OSError(errno.EINVAL, "it is a device, pipe or socket, not a file", os.fspath(path))
    return path.open("rb")


def read_regular(path: Path, max_bytes: int) -> bytes:
    """Return the contents of a regular file that is not too large.

    Parameters
    ----------
    path
        The file, or a link to it.
    max_bytes
        Largest size, bytes; of a larger file nothing is read.

    Returns
    -------
    bytes
        Its contents.

    Raises
    ------
    OSError
        It cannot be read, is no regular file, or is too large; ``strerror`` says which.
    """
    with open_regular(path) as stream:
        stated = os.fstat(stream.fileno()).st_size
        # some files of the kernel state no size, and a file may grow
        content = stream.read(max_bytes + 1) if stated <= max_bytes else b""
    if stated > max_bytes or len(content) > max_bytes:
        raise OSError(errno.EFBIG, f"it has more than {max_bytes} bytes", os.fspath(path))
    return content
