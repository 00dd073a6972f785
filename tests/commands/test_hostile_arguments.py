"""Every command with arguments that nobody means: one line on stderr and exit status 2, or the work, never a traceback.

A table has one command line per command; each of its arguments is replaced in turn by each hostile value.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import typer.main

from commands import main, run
from exports.text import single_line
from migrations.history import upgrade
from tests.backends import about_the_sqlite_file
from tests.contract.spine_results import summary
from tests.paths import SAMPLES
from tests.store.builders import stage_result, triad

pytestmark = about_the_sqlite_file

D1 = SAMPLES / "D1"
RIG, SETUP = str(D1 / "rig.json"), str(D1 / "spine.json")
LEFT, RIGHT = str(D1 / "PRE" / "left.png"), str(D1 / "PRE" / "right.png")
NOWHERE = "http://127.0.0.1:9"

COMMANDS: tuple[tuple[str, ...], ...] = (
    ("process", LEFT, RIGHT, "--rig", RIG, "--earlier", "none.json"),
    ("process", LEFT, RIGHT, "--rig", RIG, "--templates", "none.npz"),
    ("process", "none.png", RIGHT, "--rig", RIG, "--range", "630,760", "--marker", "flat-10-14-18"),
    ("process", "none.png", RIGHT, "--rig", RIG, "--labels", "L1,T9", "--extra-levels", "L6"),
    ("calibrate", "none.csv", "none.csv", "--image-size", "568x416", "--pixel-size", "0.01,0.01"),
    ("calibrate", "none.csv", "none.csv", "--free", "f", "--fix", "x0=0", "--name", "rig"),
    ("calibrate", LEFT, "none.png", "--control-field", "pegboard-1995", "--report", "out.html"),
    ("convert", RIG, "--out", "out.json", "--name", "rig"),
    ("convert", RIG, "--from", "opencv", "--to", "1995", "--out", "out.dat", "--image-size", "568x416"),
    ("simulate", "out", "--rig", RIG, "--labels", "L1,T9"),
    ("plan", "--rig", RIG, "--levels", "L1,T9", "--marker", "flat-10-14-18"),
    ("spine", SETUP, "PRE=a.json", "POST=b.json", "--reference", "L1", "--extra-levels", "L6", "--out", "out.json"),
    ("spine", SETUP, "PRE=a.json", "--radiograph", "none.json"),
    ("spine", SETUP, f"PRE=a.json,{LEFT},{RIGHT}"),
    ("report", "--file", "summary.json", "--out", "out.html"),
    ("report", "ID", "--url", NOWHERE, "--key", "sw_a_b", "--out", "out.html"),
    ("export", "json", "--file", "summary.json", "--stage", "PRE", "--out", "out.json"),
    ("export", "csv", "ID", "--url", NOWHERE, "--key", "sw_a_b"),
    ("igtl", "--file", "none.json", "--stage", "PRE"),
    ("igtl", "ID", "--url", NOWHERE, "--key", "sw_a_b", "--host", "127.0.0.1", "--port", "0"),
    ("sample", "--url", NOWHERE, "--key", "sw_a_b", "--samples", str(SAMPLES)),
    ("disparity", "--rig", RIG),
    ("field", "try", "none", "--rig", RIG),
    ("field", "design", "out.csv"),
    ("templates", "build", "none", "--rig", RIG, "--out", "out.npz", "--version", "v"),
    ("templates", "build-1995", "none", "--rig", RIG, "--out", "out.npz"),
    ("pix2mm", "none.dat", "--image-size", "568x416", "--pixel-size", "0.01,0.01"),
    ("ndlt", "none.csv", "--image-size", "568x416"),
    ("v2stereo", "none.csv", "none.csv", "--out", "out.dat"),
    ("sim3d", RIG, "none.csv", "none.csv"),
    ("detect", "none.png", "--out", "out.dat", "--ball", "9,10"),
    ("match", "none.dat", "none.dat", "--cameras", RIG, "--labels", "L1", "--out", "out"),
    ("spaco", "none.dat", "--cameras", RIG),
    ("sbom", "--lock", "none.lock", "--output", "out.json"),
    ("backup", "out.sqlite"),
    ("verify", "none.sqlite"),
    ("restore", "none.sqlite"),
    ("purge", "ID", "--reason", "test", "--export-to", "none", "--yes"),
    ("audit", "verify", "none.jsonl", "--expect", f"1:{64 * 'a'}"),
    ("audit", "export", "out.json", "--surgery", "ID"),
    ("key", "create", "cart", "--scope", "nothing"),
    ("key", "revoke", "aaaaaaaa"),
    ("serve", "--host", "127.0.0.1", "--port", "PORT", "--tls-cert", "none.pem", "--tls-key", "none.pem"),
    ("serve", "--behind-proxy", "--host", "127.0.0.1", "--port", "PORT"),
    ("run", "--behind-proxy", "--host", "127.0.0.1", "--port", "PORT"),
)  # fmt: skip
WITHOUT_ARGUMENTS = {("worker",), ("db", "upgrade"), ("key", "list")}

HOSTILE = {
    "empty": "",
    "device": "/dev/zero",
    "pipe": "pipe",
    "large": "large",
    "long": "a" * 300,
    "lines": "a\nb\r\x1b[31m\u2028\u202e",
    "bytes": "\udcff",
    "digits": "9" * 5000,
    "binary": "binary",
}


COMMAND = typer.main.get_command(main.cli)
"""All commands, made once for all calls."""


def leaves() -> Iterator[tuple[str, ...]]:
    """Yield the names of every command."""
    waiting: list[tuple[tuple[str, ...], Any]] = [((), COMMAND)]
    while waiting:
        path, command = waiting.pop()
        below = getattr(command, "commands", {})
        waiting += [((*path, name), each) for name, each in below.items()]
        if not below:
            yield path


LEAVES = tuple(leaves())


def test_every_command_is_in_the_table() -> None:
    known = {path for line in COMMANDS for path in LEAVES if line[: len(path)] == path}
    assert known | WITHOUT_ARGUMENTS == set(LEAVES)


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """A port that cannot be listened on."""
    with socket.socket() as taken:
        taken.bind(("0.0.0.0", 0))  # noqa: S104 - nothing is answered
        taken.listen()
        yield taken.getsockname()[1]


@pytest.fixture(scope="module")
def migrated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty database of this version."""
    path = tmp_path_factory.mktemp("hostile") / "database.sqlite"
    upgrade(f"sqlite:///{path}")
    return path


@pytest.fixture
def folder(tmp_path: Path, migrated: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A working folder with a database; handlers of signals are put back."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(migrated, tmp_path / "database.sqlite")
    monkeypatch.setenv("SPINEWATCH_DATABASE_URL", f"sqlite:///{tmp_path}/database.sqlite")
    monkeypatch.setattr(run, "start_log", lambda _: None)
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield tmp_path
    for number, handler in handlers.items():
        signal.signal(number, handler)


def write_files(folder: Path) -> None:
    """Write a file of every hostile kind, and results of two stages with their summary."""
    if not (folder / "pipe").exists():
        os.mkfifo(folder / "pipe")
    (folder / "large").touch()
    os.truncate(folder / "large", 1 << 40)
    (folder / "binary").write_bytes(bytes(range(256)))
    for name, x_mm in (("a", 0.0), ("b", 1.0)):
        triads = [triad("L1", position_mm=[x_mm, 0.0, 0.0]), triad("T9", position_mm=[60.0, 0.0, 0.0])]
        (folder / f"{name}.json").write_text(stage_result(triads).model_dump_json())
    (folder / "summary.json").write_text(summary().model_dump_json())


def call(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str]
) -> tuple[int, str]:
    """Return the exit status of a command and what it says on stderr."""
    monkeypatch.setattr(sys, "argv", ["spinewatch", *arguments])
    monkeypatch.setattr(main, "cli", COMMAND)
    with pytest.raises(SystemExit) as stopped:
        main.app()
    return int(stopped.value.code or 0), capsys.readouterr().err


@pytest.mark.parametrize("line", COMMANDS, ids=lambda line: " ".join(map(os.path.basename, line)))
def test_a_hostile_argument_is_refused_in_one_line(
    line: tuple[str, ...],
    folder: Path,
    port: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    usual = [str(port) if each == "PORT" else each for each in line]
    first = next(len(path) for path in LEAVES if line[: len(path)] == path)
    for place, kind in product(range(first, len(line)), HOSTILE):
        if line[place].startswith("--") or (kind == "pipe" and line[place].startswith("out")):
            continue  # who writes to a pipe waits for who reads it
        write_files(folder)
        arguments = [*usual[:place], HOSTILE[kind], *usual[place + 1 :]]
        status, said = call(monkeypatch, capsys, arguments)
        shown = ascii(arguments)  # a report of names that are no text cannot be printed
        assert status in {0, 2}, shown
        if status == 2:
            assert said.startswith("spinewatch: "), shown
            assert said.removesuffix("\n") == single_line(said.removesuffix("\n")), shown


@pytest.mark.parametrize("kind", ["device", "long", "lines", "bytes"])
@pytest.mark.parametrize("setting", ["DATABASE_URL", "QUEUE_URL"])
def test_a_hostile_setting_is_refused_in_one_line(
    setting: str,
    kind: str,
    folder: Path,
    port: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv(f"SPINEWATCH_{setting}", f"sqlite:///{HOSTILE[kind]}")
    for line in (("serve", "--port", str(port)), ("key", "list"), ("backup", "out"), ("db", "upgrade")):
        write_files(folder)
        status, said = call(monkeypatch, capsys, list(line))
        assert status in {0, 2}, line
        if status == 2:
            assert said.removesuffix("\n") == single_line(said.removesuffix("\n")), line
