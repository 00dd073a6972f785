"""Validators from npm, run by Node."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from tests.validators.installed import SCRIPTS, NotAvailableError, installed

_DESCRIPTION = ("package.json", "package-lock.json", ".npmrc")
_UNREACHABLE = (
    "ENOTFOUND",
    "ECONNREFUSED",
    "ECONNRESET",
    "ETIMEDOUT",
    "EAI_AGAIN",
    "ENETUNREACH",
    "ENOTCACHED",
)


def packages() -> Path:
    """Return the folder of the installed packages; raises ``NotAvailableError`` without Node or the registry."""
    missing = [name for name in ("node", "npm") if shutil.which(name) is None]
    if missing:
        raise NotAvailableError(f"{' and '.join(missing)} not installed")
    return installed("npm", _DESCRIPTION, _install) / "node_modules"


def _install(folder: Path) -> None:
    done = subprocess.run(
        ["npm", "ci"], cwd=folder, check=False, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    if done.returncode:
        if any(code in done.stderr for code in _UNREACHABLE):
            raise NotAvailableError("the npm registry does not answer")
        raise AssertionError(f"npm ci failed: {done.stderr}")


def validate(script: str, *arguments: Path | str) -> Any:
    """Run a script of this folder and return the JSON document that it prints."""
    done = subprocess.run(
        ["node", SCRIPTS / script, *arguments],
        env={**os.environ, "NODE_PATH": str(packages())},
        check=False,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
