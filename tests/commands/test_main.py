from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest
import typer.main

from commands import main
from exports.text import single_line
from spinewatch.errors import ParameterError
from tests.paths import PROJECT


def number_options() -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield every option of every command that takes numbers, with the path of its command."""
    waiting: list[tuple[tuple[str, ...], Any]] = [((), typer.main.get_command(main.cli))]
    while waiting:
        path, command = waiting.pop()
        waiting += [((*path, name), below) for name, below in getattr(command, "commands", {}).items()]
        for parameter in command.params:
            if kind_of(parameter) is not None:
                yield path, parameter


def kind_of(parameter: Any) -> type[float] | None:
    """Return the type of the numbers that a parameter takes, None if it takes none."""
    annotation = parameter.type_descriptor.annotation
    kinds = {int: int, float: float, tuple[int, int]: int, tuple[float, float]: float}
    return kinds.get(annotation)


NUMBERS = {f"{' '.join(path)} {parameter.opts[0]}": (path, parameter) for path, parameter in number_options()}


def refusal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Return the one line that wrong arguments end with."""
    monkeypatch.setattr(sys, "argv", ["spinewatch", *arguments])
    with pytest.raises(SystemExit) as stopped:
        main.app()
    out, err = capsys.readouterr()
    assert (stopped.value.code, out, len(err.splitlines())) == (2, "", 1)
    assert err.startswith("spinewatch: ")
    return err


def test_numbers_are_found_in_every_kind_of_command() -> None:
    assert {"plan --spacing", "disparity --heights", "field try --noise", "purge --older-than"} <= set(
        NUMBERS
    )


@pytest.mark.parametrize("name", NUMBERS)
def test_every_number_has_limits_and_is_refused_beyond_them(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, parameter = NUMBERS[name]
    low, high = parameter.min, parameter.max
    assert low is not None, "give the option a smallest value"
    assert high is not None, "give the option a largest value"
    beyond = [low - 1, high + 1, 10**30, -(10**30)]
    if kind_of(parameter) is float:
        beyond += [float("nan"), float("inf"), float("-inf"), 1e300]
    for value in beyond:
        line = refusal(monkeypatch, capsys, *path, parameter.opts[0], *[str(value)] * parameter.nargs)
        assert parameter.opts[0] in line
        assert f"give {low:.12g} to {high:.12g}; see" in line


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("plan",), "--rig"),
        (("plan", "--rig"), "--rig"),
        (("plan", "--spacing", "far"), "--spacing"),
        (("plan", "--nothing"), "--nothing"),
        (("nothing",), "nothing"),
        (("export",), "FORMAT"),
    ],
)
def test_wrong_arguments_are_one_line_that_names_them(
    arguments: tuple[str, ...],
    words: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    line = refusal(monkeypatch, capsys, *arguments)
    assert words in line
    assert "--help" in line


def test_no_arguments_are_answered_with_the_help(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["spinewatch"])
    with pytest.raises(SystemExit) as stopped:
        main.app()
    out, err = capsys.readouterr()
    assert (stopped.value.code, err) == (2, "")
    assert "disparity" in out


def test_a_named_error_is_one_line_and_exit_status_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(standalone_mode: bool) -> None:
        raise ParameterError("the number is wrong; give another")

    monkeypatch.setattr(main, "cli", fail)
    with pytest.raises(SystemExit) as stopped:
        main.app()
    assert stopped.value.code == 2
    assert capsys.readouterr() == ("", "spinewatch: the number is wrong; give another\n")


@pytest.mark.parametrize("break_", ["\n", "\r\n", "\x1b[31m", "\x85", "\u2028", "\u202e", "\udcff"])
def test_a_refusal_is_one_line_without_control_characters(
    break_: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    name = f"no{break_}file.json"
    for arguments in (
        ("disparity", "--rig", name),  # a named error
        ("disparity", "--rig", "rig.json", f"--no{break_}option"),
        (f"no{break_}command",),
        ("disparity", "--rig", "rig.json", "--planes", f"1{break_}2"),
    ):
        line = refusal(monkeypatch, capsys, *arguments).removesuffix("\n")
        assert line == single_line(line)


def test_help_loads_no_large_library() -> None:
    large = {"cv2", "scipy", "sqlalchemy", "fastapi", "httpx", "jinja2", "rich.progress"}
    code = f"import sys, commands.main; print(*sorted({large} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PROJECT
    )
    assert done.stdout.strip() == ""


def test_numpy_finds_one_thread_of_linear_algebra() -> None:
    code = "import sys, commands.main, os; print(os.environ['OPENBLAS_NUM_THREADS'])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=PROJECT
    )
    assert done.stdout.strip()
