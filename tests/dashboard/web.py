"""The sources of the page and the Node packages that build and test it."""

from __future__ import annotations

import fcntl
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

from tests.paths import PROJECT

WEB = PROJECT / "web"
BUILT = PROJECT / "service" / "dashboard"
_UNREACHABLE = (
    "ENOTFOUND",
    "ECONNREFUSED",
    "ECONNRESET",
    "ETIMEDOUT",
    "EAI_AGAIN",
    "ENETUNREACH",
    "ENOTCACHED",
)


class NotAvailableError(Exception):
    """The page cannot be built on this machine; the message says why."""


def packages() -> Path:
    """Install the Node packages of the page unless they are there, and return their folder.

    Raises
    ------
    NotAvailableError
        Node, npm or the registry is missing.
    """
    missing = [name for name in ("node", "npm") if shutil.which(name) is None]
    if missing:
        raise NotAvailableError(f"{' and '.join(missing)} not installed")
    folder = PROJECT / "build"
    folder.mkdir(exist_ok=True)
    with (folder / "web.lock").open("w") as lock:  # parallel test processes wait for each other
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not _is_installed():
            _install()
    return WEB / "node_modules"


def run(*command: str, cwd: Path = WEB) -> str:
    """Run a command among the packages and return what it prints; a failure shows that."""
    done = subprocess.run(
        ["npx", "--no-install", *command],
        cwd=cwd,
        check=False,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return done.stdout


def _is_installed() -> bool:
    """Return whether the packages are those of the lock file; npm writes down what it installed."""
    written = WEB / "node_modules" / ".package-lock.json"
    if not written.is_file():
        return False
    there, wanted = _versions(written), _versions(WEB / "package-lock.json")
    return all(there.get(name) == version for name, version in wanted.items())


def _versions(path: Path) -> dict[str, str]:
    """Return the versions of the packages that every machine needs."""
    locked: dict[str, dict[str, Any]] = json.loads(path.read_text())["packages"]
    return {
        name: package["version"] for name, package in locked.items() if name and not package.get("optional")
    }


def _install() -> None:
    done = subprocess.run(
        ["npm", "ci"], cwd=WEB, check=False, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    if done.returncode:
        if any(code in done.stderr for code in _UNREACHABLE):
            raise NotAvailableError("the npm registry does not answer")
        raise AssertionError(f"npm ci failed: {done.stderr}")
