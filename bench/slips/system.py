"""Slips of the surroundings: folders that cannot be written, names that are no text."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from bench.slips.run import run_command
from bench.slips.slip import Answer, Outcome, Right, Slip
from bench.slips.sound import BOARD, board_files, process_arguments, stage_files


def slips() -> Iterator[Slip]:
    """Yield the slips of files and folders."""
    one_line = Right(refusal=r"cannot|name|UTF-8|write|read")
    either = Right(refusal=r"cannot|name|UTF-8|write|read", sound=_has_report)
    yield Slip(
        "a folder whose name is not UTF-8, with a report", "system", "C", "calibrate", either, _odd_folder
    )
    yield Slip(
        "an image in a folder whose name is not UTF-8, missing",
        "system",
        "PRE",
        "process",
        one_line,
        _odd_missing,
    )
    yield Slip(
        "the result into a folder that is a file",
        "system",
        "PRE",
        "process",
        one_line,
        lambda folder: [*process_arguments(stage_files("PRE")), "--out", _file(folder) / "out.json"],
    )
    yield Slip(
        "the rig into a folder that does not exist",
        "system",
        "C",
        "calibrate",
        one_line,
        lambda folder: [*board_files("C"), "--control-field", BOARD, "--out", folder / "none" / "rig.json"],
    )
    database = Right(refusal=r"database|folder|write")
    yield Slip("a database folder that cannot be written", "system", "-", "db", database, _database)
    yield Slip("a database that is none", "system", "-", "db", database, _no_database)


def run_database(slip: Slip, folder: Path) -> Outcome:
    """Run a slip of the database: the arguments are the URL, which goes into the environment."""
    if slip.make is None:
        raise ValueError(f"{slip.name!r} has no maker")
    (url,) = slip.make(folder)
    key = "SPINEWATCH_DATABASE_URL"
    before = os.environ.get(key)
    os.environ[key] = str(url)
    try:
        answer = run_command("db", ["upgrade"])
    finally:
        if before is None:
            del os.environ[key]
        else:
            os.environ[key] = before
    return Outcome(slip, answer)


def _has_report(answer: Answer) -> bool:
    return bool(answer.document.get("rig"))


def _file(folder: Path) -> Path:
    path = folder / "file"
    path.write_text("no folder\n")
    return path


def _odd_folder(folder: Path) -> Sequence[object]:
    odd = Path(os.fsdecode(os.fsencode(folder) + b"/shot-\xff\xfe"))
    odd.mkdir()
    files = []
    for file in board_files("C"):
        files.append(odd / file.name)
        files[-1].write_bytes(file.read_bytes())
    # two shots, so that they are named by their folders
    more = board_files("A")
    return [*files, *more, "--control-field", BOARD, "--report", folder / "report.html"]


def _odd_missing(folder: Path) -> Sequence[object]:
    odd = Path(os.fsdecode(os.fsencode(folder) + b"/\xff"))
    return process_arguments([odd / "left.png", odd / "right.png"])


def _database(folder: Path) -> Sequence[object]:
    return [f"sqlite:///{_file(folder) / 'record.sqlite'}"]


def _no_database(folder: Path) -> Sequence[object]:
    path = folder / "record.sqlite"
    path.write_bytes(b"no database, but longer than the header of one\n" * 40)
    return [f"sqlite:///{path}"]
