"""Files that are being written, under a temporary name that is freed when their process is killed."""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

_NAME = re.compile(r"\..+\.spinewatch-partial-[0-9]+")


@contextmanager
def partial_file(target: Path, companions: Sequence[str] = ()) -> Iterator[tuple[Path, int]]:
    """Make a new empty file of mode 0600 beside a target, and remove it at the end unless it has got another name.

    The file is locked while its process lives. What killed processes have left in the folder, for whatever target, is
    removed before.

    Parameters
    ----------
    target
        The file that is to be written.
    companions
        Endings of further files that belong to the temporary one.

    Yields
    ------
    tuple of Path and int
        The temporary file, and a handle of it for reading and writing.

    Raises
    ------
    OSError
        The file cannot be made.
    """
    _remove_abandoned(target.parent, companions)
    partial = target.with_name(f".{target.name}.spinewatch-partial-{os.getpid()}")
    handle = os.open(partial, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield partial, handle
    finally:
        _remove(partial, companions)
        os.close(handle)


def _remove_abandoned(folder: Path, companions: Sequence[str]) -> None:
    """Remove the temporary files of a folder that no process has locked; a process of another machine may have one."""
    with suppress(OSError):
        for name in filter(_NAME.fullmatch, os.listdir(folder)):
            with suppress(OSError):
                handle = os.open(folder / name, os.O_RDWR | os.O_NOFOLLOW)
                try:
                    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    _remove(folder / name, companions)
                finally:
                    os.close(handle)


def _remove(partial: Path, companions: Sequence[str]) -> None:
    for ending in ("", *companions):
        partial.with_name(partial.name + ending).unlink(missing_ok=True)
