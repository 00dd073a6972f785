"""The supervisor in a process of its own, since it installs signal handlers."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.paths import PROJECT
from tests.patience import PATIENCE_S

SUPERVISOR = """
import sys
from commands.shared.supervisor import Child, Supervisor
children = [Child(str(n), [sys.executable, "-c", code]) for n, code in enumerate(sys.argv[1:])]
sys.exit(Supervisor(children, {"GREETING": "hello"}).run(lambda: None))
"""


def start(*codes: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", SUPERVISOR, *codes],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=PROJECT,
    )


def wait_until(path: Path, lines: int) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not path.exists() or len(path.read_text().splitlines()) < lines:
        assert time.monotonic() < deadline, path
        time.sleep(0.05)


def appending(path: Path, then: str) -> str:
    return f"import os, sys, time; print(os.environ['GREETING'], file=open({str(path)!r}, 'a')); {then}"


def test_a_child_that_ends_is_restarted_and_all_stop_together(tmp_path: Path) -> None:
    short, long = tmp_path / "short", tmp_path / "long"
    with start(appending(short, "sys.exit(1)"), appending(long, "time.sleep(60)")) as supervisor:
        wait_until(short, 2)
        wait_until(long, 1)
        supervisor.send_signal(signal.SIGTERM)
        out, _ = supervisor.communicate(timeout=PATIENCE_S)
    assert supervisor.returncode == 0
    assert set(short.read_text().splitlines()) == {"hello"}
    assert long.read_text().splitlines() == ["hello"]
    assert "process_ended" in out


def test_a_command_that_cannot_start_ends_the_supervisor(tmp_path: Path) -> None:
    other = tmp_path / "other"
    with start("import sys; sys.exit(2)", appending(other, "time.sleep(60)")) as supervisor:
        supervisor.communicate(timeout=PATIENCE_S)
    assert supervisor.returncode == 2


def test_a_command_that_started_before_is_restarted_although_it_cannot_start_now(tmp_path: Path) -> None:
    starts = tmp_path / "starts"
    with start(
        appending(starts, f"sys.exit(2 if len(open({str(starts)!r}).readlines()) > 1 else 1)")
    ) as supervisor:
        wait_until(starts, 4)
        supervisor.send_signal(signal.SIGTERM)
        supervisor.communicate(timeout=PATIENCE_S)
    assert supervisor.returncode == 0


BEATING_ONCE = """
import os, signal
from commands.shared.watchdog import notifier
notifier()()
print(os.getpid(), file=open({path!r}, "a"), flush=True)
os.kill(os.getpid(), signal.SIGSTOP)
"""


def test_a_child_that_is_stopped_is_killed_and_restarted(tmp_path: Path) -> None:
    stopped = tmp_path / "stopped"
    code = SUPERVISOR.replace('{"GREETING": "hello"}', "{}, 1.0")
    arguments = [sys.executable, "-c", code, BEATING_ONCE.format(path=str(stopped))]
    with subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=PROJECT
    ) as supervisor:
        wait_until(stopped, 2)
        supervisor.send_signal(signal.SIGTERM)
        out, _ = supervisor.communicate(timeout=PATIENCE_S)
    assert "process_silent" in out
    assert "status=-9" in out
