"""New files that only their owner can read, whole or not there at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from store.errors import ExportFileError
from store.partial_file import partial_file


@contextmanager
def private_file(target: Path) -> Iterator[BinaryIO]:
    """Write a new file of mode 0600; it gets its name once it is written and synced to the disk.

    Parameters
    ----------
    target
        The file, which must not exist.

    Yields
    ------
    BinaryIO
        What to write to; it can be read back, too.

    Raises
    ------
    ExportFileError
        The file exists or cannot be written.
    """
    if os.path.lexists(target):
        raise ExportFileError(f"{target} exists; choose another name")
    try:
        with partial_file(target) as (partial, handle):
            with os.fdopen(handle, "w+b", closefd=False) as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            os.rename(partial, target)
            _sync_folder(target.parent)
    except OSError as error:
        raise ExportFileError(f"cannot write {target}: {error.strerror}; choose another folder") from error


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
