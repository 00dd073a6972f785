"""Packages that only validators need: installed once into `build/validators`, outside the tree of sources."""

from __future__ import annotations

import fcntl
import hashlib
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.paths import PROJECT

SCRIPTS = PROJECT / "tests" / "validators"
_CACHE = PROJECT / "build" / "validators"


class NotAvailableError(Exception):
    """The validator cannot be had on this machine; the message says why."""


def installed(name: str, description: Sequence[str], install: Callable[[Path], None]) -> Path:
    """Return the folder of an installation, made by ``install`` once per content of its description.

    Parallel test processes wait for each other.
    """
    digest = hashlib.sha256(b"".join((SCRIPTS / file).read_bytes() for file in description)).hexdigest()[:16]
    folder = _CACHE / f"{name}-{digest}"
    _CACHE.mkdir(parents=True, exist_ok=True)
    with (_CACHE / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "complete").exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            for file in description:
                shutil.copy(SCRIPTS / file, folder)
            install(folder)
            (folder / "complete").touch()
    return folder
