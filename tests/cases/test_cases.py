"""Each case gives its right answer: no wrong number without a flag, and no traceback."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from bench.mistakes import all_slips
from bench.slips import service, system
from bench.slips.run import run_command, run_slip
from bench.slips.service import SlipService
from bench.slips.slip import Outcome, Right, Slip
from tests.cases.cases import CASES, DERIVED, HERE, Case
from tests.cases.pending import PENDING

RIGHT_VERDICTS = {"refused", "flagged", "read"}
SLIPS = {slip.name: slip for slip in all_slips()}
ASKED = tuple(slip for slip in SLIPS.values() if slip.ask is not None)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SlipService]:
    with service.running(tmp_path_factory.mktemp("service")) as started:
        yield started


def marked(values: Iterable[Any], name: Callable[[Any], str] = lambda value: value.name) -> list[Any]:
    """Return test parameters; those of pending cases must fail (strict)."""
    return [pytest.param(value, id=name(value), marks=_marks(name(value))) for value in values]


def _marks(name: str) -> Sequence[pytest.MarkDecorator]:
    return [pytest.mark.xfail(strict=True, reason=PENDING[name])] if name in PENDING else []


@pytest.mark.parametrize("case", marked(CASES))
def test_case(case: Case, tmp_path: Path) -> None:
    answer = run_command(case.command, case.resolved(tmp_path))
    _judge(case.right, Outcome(Slip(case.name, "sound", "-", case.command, case.right), answer))
    if answer.status == 2:
        assert answer.message.startswith("spinewatch: ")
        assert len(answer.message.splitlines()) == 1


@pytest.mark.parametrize("name", marked(DERIVED, str))
def test_derived_case(name: str, tmp_path: Path) -> None:
    slip = SLIPS[name]
    run = system.run_database if slip.command == "db" else run_slip
    _judge(slip.right, run(slip, tmp_path))


@pytest.mark.parametrize("slip", marked(ASKED))
def test_case_of_the_service(slip: Slip, running: SlipService, tmp_path: Path) -> None:
    _judge(slip.right, service.ask_slip(slip, running, tmp_path))


def test_every_file_belongs_to_a_case() -> None:
    named = {argument[1:] for case in CASES for argument in case.arguments if argument.startswith("@")}
    folders = {Path(name) for name in named if (HERE / name).is_dir()}
    files = {path.relative_to(HERE) for path in HERE.rglob("*") if path.is_file() and path.parent != HERE}
    beside = {Path("opencv-stereo/extrinsics.yml")}
    unused = {
        path
        for path in files - beside
        if str(path) not in named and path.parent not in folders and "__pycache__" not in path.parts
    }
    assert not unused


def test_every_case_has_a_row_in_the_readme() -> None:
    text = (HERE / "README.md").read_text()
    assert not [case.name for case in CASES if f"| {case.name} |" not in text]
    assert not [name for name in DERIVED if f"| {name} |" not in text]


def _judge(right: Right, outcome: Outcome) -> None:
    assert right.verdict(outcome.answer) in RIGHT_VERDICTS, outcome.figures or outcome.answer.message


def test_every_pending_case_exists() -> None:
    assert set(PENDING) <= {case.name for case in CASES} | set(DERIVED) | {slip.name for slip in ASKED}
