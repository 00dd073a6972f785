"""Standard output that is full, closed or read by nobody, for commands as processes."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.paths import PROJECT, SAMPLES

D1 = SAMPLES / "D1"
PAIR = (str(D1 / "PRE" / "left.png"), str(D1 / "PRE" / "right.png"))
COMMANDS = {
    "version": ("--version",),
    "help": ("plan", "--help"),
    "echo": ("sbom",),
    "table": ("disparity", "--rig", str(D1 / "rig.json")),
    "document": ("process", *PAIR, "--rig", str(D1 / "rig.json")),
}


def ran(command: tuple[str, ...], unbuffered: str = "", **streams: Any) -> tuple[int, list[str]]:
    """Return exit status and lines of stderr."""
    done = subprocess.run(
        [sys.executable, "-m", "commands", *command],
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        timeout=120,
        cwd=PROJECT,
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
        **streams,
    )
    return done.returncode, done.stderr.splitlines()


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_full_output_is_one_line(command: str, unbuffered: str) -> None:
    with open("/dev/full", "wb") as full:
        status, lines = ran(COMMANDS[command], unbuffered, stdout=full)
    assert (status, len(lines)) == (2, 1), lines
    assert lines[0].startswith("spinewatch: cannot write the output: No space left")


@pytest.mark.parametrize("command", COMMANDS)
def test_a_closed_output_is_one_line(command: str) -> None:
    status, lines = ran(COMMANDS[command], preexec_fn=lambda: os.close(1))
    assert (status, len(lines)) == (2, 1), lines
    assert lines[0].startswith("spinewatch: standard output is closed")


@pytest.mark.parametrize("command", COMMANDS)
def test_an_output_that_nobody_reads_is_no_error_to_report(command: str) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    status, lines = ran(COMMANDS[command], stdout=writer)
    os.close(writer)
    assert (status, lines) == (1, [])


def test_an_output_that_takes_everything_is_written() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "commands", *COMMANDS["table"]], capture_output=True, check=True, cwd=PROJECT
    )
    assert "Disparity u" in done.stdout.decode("utf-8")


def test_names_that_are_no_text_are_printed_with_escapes(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"a\xff.csv")
    done = subprocess.run(
        [sys.executable, "-m", "commands", "field", "design", path],
        stdout=subprocess.PIPE,
        check=True,
        timeout=120,
        cwd=PROJECT,
        env={**os.environ, "PYTHONIOENCODING": "utf-8:strict"},
    )
    assert b"a\\udcff.csv: " in done.stdout
    assert path.exists()


def test_a_program_that_calls_commands_keeps_its_output() -> None:
    lines = (
        "import contextlib, io, sys",
        "from commands.main import app",
        "sys.argv = ['spinewatch', 'convert', sys.argv[1], '--out', '/no/such/folder/rig.json']",
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):",
        "    app()",
        "print('still here')",
    )
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(lines), str(D1 / "rig.json")],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        cwd=PROJECT,
    )
    assert done.stdout == "still here\n"
    assert "/no/such/folder" in done.stderr
