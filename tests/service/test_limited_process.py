"""A process with limits: its answer, and an end by name for what takes too much."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import pytest
from starlette.exceptions import HTTPException

from service.limited_process import (
    NoAnswerError,
    ProcessLimits,
    TooCostlyError,
    answer_of,
    stored,
)
from tests.http.harness import wait_for

LIMITS = ProcessLimits(cpu_seconds=20, memory_bytes=1 << 30, seconds=120.0)
_MODULE = """
import os, signal, sys, time
from service.limited_process import serve

def answer(data, arguments):
    yield data
    what = arguments[0] if arguments else ""
    if what == "settings":
        yield str([name for name in os.environ if name.startswith("SPINEWATCH")]).encode()
    elif what == "prints":
        os.write(1, b"a word of a library")
        yield b" and the end"
    elif what == "memory":
        yield bytes(2 << 30)
    elif what == "time":
        while True:
            pass
    elif what == "sleeps":
        time.sleep(600)
    elif what == "defect":
        raise ValueError
    elif what:
        os.kill(os.getpid(), getattr(signal, what))

serve(answer)
"""
_PARENT = """
from service.limited_process import ProcessLimits, answer_of, stored
answer_of("limited_example", ["sleeps"], stored([b"x"]), ProcessLimits(20, 1 << 30, 120.0))
"""


@pytest.fixture(autouse=True)
def _module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "limited_example.py").write_text(_MODULE)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, sys.path)]))


def answer(*arguments: str, limits: ProcessLimits = LIMITS) -> bytes:
    with stored([b"in", b"put"]) as source, answer_of("limited_example", arguments, source, limits) as found:
        return found.read()


def test_the_answer_is_what_the_module_makes_of_its_input() -> None:
    assert answer() == b"input"


def test_what_a_library_prints_is_not_in_the_answer() -> None:
    assert answer("prints") == b"input and the end"


def test_the_process_knows_no_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPINEWATCH_DATABASE_URL", "postgresql://secret")
    assert answer("settings") == b"input[]"


def test_modules_of_the_working_folder_are_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "working"
    folder.mkdir()
    (folder / "structlog.py").write_text("raise SystemExit(1)")
    monkeypatch.chdir(folder)
    assert answer() == b"input"


@pytest.mark.parametrize("what", ["memory", "time", "SIGABRT", "SIGTRAP"])
def test_what_takes_too_much_is_named(what: str) -> None:
    with pytest.raises(TooCostlyError):
        answer(what, limits=ProcessLimits(cpu_seconds=1, memory_bytes=1 << 30, seconds=120.0))


@pytest.mark.parametrize("what", ["defect", "SIGSEGV"])
def test_a_process_that_breaks_has_no_answer(what: str) -> None:
    with pytest.raises(NoAnswerError):
        answer(what)


@pytest.mark.parametrize(
    ("what", "seconds", "reason"), [("sleeps", 0.001, "busy"), ("SIGKILL", 120.0, "memory")]
)
def test_a_machine_that_has_too_much_to_do_is_to_be_asked_again(
    what: str, seconds: float, reason: str
) -> None:
    with pytest.raises(HTTPException, match=reason) as error:
        answer(what, limits=ProcessLimits(20, 1 << 30, seconds))
    assert error.value.status_code == 503
    assert "Retry-After" in (error.value.headers or {})


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a disk that is always full is a device of Linux")
def test_a_full_disk_is_named() -> None:
    class Full(BytesIO):
        def fileno(self) -> int:
            raise OSError("no space left on device")

    with pytest.raises(HTTPException, match="TMPDIR") as error:
        answer_of("limited_example", [], Full(), LIMITS)
    assert error.value.status_code == 507
    with pytest.raises(HTTPException, match="TMPDIR") as error:
        stored(_unwritable())
    assert error.value.status_code == 507


def _unwritable() -> Iterator[bytes]:
    with open("/dev/full", "wb", buffering=0) as disk:
        disk.write(b"x")
    yield b"x"


def test_the_process_ends_with_the_server_and_before_it_when_memory_is_short(tmp_path: Path) -> None:
    parent = subprocess.Popen([sys.executable, "-c", _PARENT])

    def child() -> int | None:
        found = Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text().split()
        limited = [pid for pid in found if Path(f"/proc/{pid}/oom_score_adj").read_text() == "1000\n"]
        return int(limited[0]) if limited else None

    pid = wait_for(child, "the process", 0.005)
    parent.kill()
    parent.wait()
    wait_for(lambda: not Path(f"/proc/{pid}").exists(), "the end of the process")
