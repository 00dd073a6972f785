"""The Dockerfile as instructions, and its build stage replayed in a folder without Docker."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.paths import PROJECT

_INSTRUCTION = re.compile(r"([A-Z]+)\s+(.*)", re.DOTALL)
_PLACES = ("/opt/spinewatch", "/src", "/data")


@dataclass(frozen=True)
class Instruction:
    """An instruction: its keyword, what follows it, the number of its stage, and the comment lines right before it."""

    keyword: str
    text: str
    stage: int
    comments: tuple[str, ...]


def instructions(text: str) -> list[Instruction]:
    """Return the instructions of a Dockerfile, continued lines joined."""
    found: list[Instruction] = []
    comments: list[str] = []
    stage = -1
    for line in text.replace("\\\n", " ").splitlines():
        if line.startswith("#"):
            comments.append(line)
            continue
        match = _INSTRUCTION.fullmatch(line.strip())
        if match is None:
            assert not line.strip(), line
            continue
        stage += match[1] == "FROM"
        found.append(Instruction(match[1], re.sub(r"\s+", " ", match[2]), stage, tuple(comments)))
        comments = []
    return found


def allowed_by_dockerignore(name: str) -> bool:
    """Return whether a file or folder at the top of the project is part of the build's context."""
    lines = (PROJECT / ".dockerignore").read_text(encoding="utf-8").split()
    return lines[0] == "*" and f"!{name}" in lines


def replay(build: list[Instruction], folder: Path) -> dict[str, str]:
    """Carry out the instructions of a stage in a folder; return the environment that finds what was installed."""
    (folder / "src").mkdir(parents=True)
    python = base_python()
    environment = {
        "PATH": f"{_linked(python, folder)}:{os.environ['PATH']}",
        "HOME": str(folder),
        "PIP_QUIET": "1",
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
        **{name: os.environ[name] for name in ("PIP_INDEX_URL", "PIP_CONFIG_FILE") if name in os.environ},
    }
    for instruction in build:
        if instruction.keyword == "COPY":
            *names, target = instruction.text.split()
            for name in names:
                assert allowed_by_dockerignore(name), name
                _copy(PROJECT / name, Path(placed(target, folder)), single=len(names) == 1)
        elif instruction.keyword == "RUN":
            command = placed(instruction.text, folder)
            subprocess.run(["sh", "-euc", command], cwd=folder, env=environment, check=True, timeout=900)
    return {**environment, "PATH": f"{folder / 'opt/spinewatch/bin'}:/usr/bin:/bin"}


def base_python() -> Path:
    """Return a Python without packages, one that every user may run where there is such."""
    candidates = [Path(sys.executable).resolve(), Path("/usr/bin/python3")]
    return next((python for python in candidates if anyone_may_run(python)), candidates[0])


def anyone_may_run(python: Path) -> bool:
    """Return whether every user may run a Python and make environments with it."""
    if not python.exists() or not all(parent.stat().st_mode & 0o001 for parent in python.resolve().parents):
        return False
    return (
        subprocess.run(
            [python, "-c", "import ensurepip, tomllib"], capture_output=True, check=False
        ).returncode
        == 0
    )


def placed(text: str, folder: Path) -> str:
    """Return a command or a path of the image with its places moved below a folder."""
    for place in _PLACES:
        text = re.sub(rf"(?<![\w/]){place}(?![\w-])", f"{folder}{place}", text)
    return text


def _linked(python: Path, folder: Path) -> Path:
    tools = folder / "tools"
    tools.mkdir()
    for name in ("python", "python3"):
        script = tools / name
        script.write_text(f'#!/bin/sh\nexec {python} "$@"\n', encoding="utf-8")
        script.chmod(0o755)
    return tools


def _copy(source: Path, target: Path, *, single: bool) -> None:
    if source.is_dir():
        shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        return
    to = target if single and not str(target).endswith("/") and not target.is_dir() else target / source.name
    shutil.copyfile(source, to)
