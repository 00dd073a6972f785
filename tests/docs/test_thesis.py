"""Every system, table and figure of the thesis has a row, and every row a command that exists."""

from __future__ import annotations

import importlib.util
import json
import re
import shlex

import pytest
from typer.main import get_command

from bench.thesis.__main__ import PARTS
from commands.main import cli
from tests.paths import PROJECT

DOCUMENT = (PROJECT / "docs" / "thesis.md").read_text()
ROWS = [
    line
    for line in DOCUMENT.splitlines()
    if line.startswith("| ") and not re.match(r"\| (program|part|wish) \|", line)
]
ROUTES = json.loads((PROJECT / "openapi" / "openapi.json").read_text())["paths"]
COMMANDS = get_command(cli)

FIGURES = {2: 6, 3: 3, 4: 47, 5: 13, 6: 3}
TABLES = {3: 4, 4: 4, 5: 6, 6: 1}
"""Number of figures and of tables of each chapter."""
PROGRAMS = ("PIX2MM", "NDLT", "V2STEREO", "SIM3D", "DETECT-POINT", "MATCH-POINT", "SPACO", "SPINE")


def commands(row: str) -> list[str]:
    """Return the commands and requests in a row."""
    return re.findall(r"`((?:spinewatch [a-z]|python -m bench|(?:GET|POST) /)[^`]*)`", row)


def named(kind: str) -> set[tuple[int, int]]:
    """Return the numbers that the rows name after a word: 4.2-4.7 stands for all between."""
    found: set[tuple[int, int]] = set()
    for row in ROWS:
        for numbers in re.findall(rf"{kind}s? ((?:\d\.\d+(?:-|, | and )?)+)", row):
            for first, last in re.findall(r"(\d\.\d+)(?:-(\d\.\d+))?", numbers):
                chapter, start = map(int, first.split("."))
                end = int(last.split(".")[1]) if last else start
                found |= {(chapter, k) for k in range(start, end + 1)}
    return found


def numbers_of(counts: dict[int, int]) -> set[tuple[int, int]]:
    return {(chapter, k) for chapter, count in counts.items() for k in range(1, count + 1)}


@pytest.mark.parametrize(("kind", "counts"), [("[Ff]ig(?:s|\\.)?", FIGURES), ("Table", TABLES)])
def test_every_figure_and_table_has_a_row(kind: str, counts: dict[int, int]) -> None:
    assert numbers_of(counts) - named(kind) == set()


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_program_has_a_row(program: str) -> None:
    assert any(row.startswith(f"| {program} |") for row in ROWS)


def test_every_row_has_a_command() -> None:
    assert [row for row in ROWS if not commands(row)] == []


def of_kind(start: str) -> list[str]:
    return sorted({command for row in ROWS for command in commands(row) if command.startswith(start)})


@pytest.mark.parametrize("command", of_kind("spinewatch "))
def test_commands_parse(command: str) -> None:
    words = shlex.split(command)[1:]
    found = COMMANDS
    while words and hasattr(found, "commands") and words[0] in found.commands:
        found = found.commands[words.pop(0)]
    assert found is not COMMANDS, command
    found.make_context(command, [*words], resilient_parsing=True)
    options = {name for parameter in found.params for name in (*parameter.opts, *parameter.secondary_opts)}
    assert {word for word in words if word.startswith("--")} <= options


@pytest.mark.parametrize("command", of_kind("python "))
def test_benches_exist(command: str) -> None:
    _, _, module, *arguments = shlex.split(command)
    assert importlib.util.find_spec(module) is not None
    if "--part" in arguments and module == "bench.thesis":
        assert arguments[arguments.index("--part") + 1] in PARTS


@pytest.mark.parametrize("request_", [*of_kind("GET "), *of_kind("POST ")])
def test_requests_are_those_of_the_interface(request_: str) -> None:
    method, path = request_.split()
    assert method.lower() in ROUTES[path]


def test_every_part_of_the_bench_is_shown() -> None:
    shown = set(re.findall(r"--part ([a-z-]+)", DOCUMENT))
    assert set(PARTS) <= shown
