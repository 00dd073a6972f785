"""3D Slicer's own libraries from PyPI, as a reader of our files."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.validators.installed import SCRIPTS, NotAvailableError, installed

_OPTIONS = (
    "--quiet", "--disable-pip-version-check", "--no-deps", "--require-hashes", "--retries", "1", "--timeout", "20"
)  # fmt: skip


def packages() -> Path:
    """Return the folder of the installed packages; raises ``NotAvailableError`` where they do not install."""
    here = (sys.version_info[:2], sys.platform, platform.machine())
    if here != ((3, 11), "linux", "x86_64"):
        raise NotAvailableError("slicer.txt has the packages of CPython 3.11 on x86-64 Linux")
    return installed("slicer", ["slicer.txt"], _install)


def _install(folder: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pip", "install", *_OPTIONS, "--target", folder, "--requirement", "slicer.txt"],
        cwd=folder, check=False, capture_output=True, text=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    if done.returncode:
        if "No matching distribution" in done.stderr or "No module named pip" in done.stderr:
            raise NotAvailableError(done.stderr.strip().splitlines()[-1])
        raise AssertionError(f"pip install failed: {done.stderr}")


def read(file: Path) -> Any:
    """Return what Slicer reads from a file: the nodes of a .mrk.json, or the matrix to parent (RAS) of a .tfm."""
    done = subprocess.run(
        [sys.executable, SCRIPTS / "read_by_slicer.py", file],
        env={**os.environ, "PYTHONPATH": str(packages())},
        check=False,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
