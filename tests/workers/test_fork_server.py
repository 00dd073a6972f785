"""A prepared process that forks others, in a program of its own: the tests' process has threads."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.paths import PROJECT

PROGRAM = """
import os, signal, sys, time
from workers.fork_server import ForkServer, ForkServerEndedError
def target(link):
    while True:
        try:
            code = link.recv()
        except EOFError:
            return
        link.send(eval(code))
server = ForkServer(target)
{rest}
"""


def run(rest: str) -> str:
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(rest=rest)],
        cwd=PROJECT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_forked_processes_answer_and_tell_how_they_end() -> None:
    out = run(
        """
first, second = server.fork(), server.fork()
for process in (first, second):
    process.connection.send("os.getpid()")
    assert process.connection.recv() == process.pid
first.kill()
print(server.wait(first), end=" ")
second.connection.send("os._exit(7)")
print(server.wait(second), end=" ")
third = server.fork()
print(server.wait(third))
"""
    )
    assert out.split() == ["-9", "7", "0"]


def test_signals_that_end_the_worker_do_not_end_its_processes() -> None:
    out = run(
        """
process = server.fork()
os.kill(process.pid, signal.SIGINT)
os.kill(process.pid, signal.SIGTERM)
process.connection.send("6 * 7")
print(process.connection.recv())
"""
    )
    assert out.split() == ["42"]


def test_an_error_in_a_forked_process_is_shown_and_is_a_status() -> None:
    out = run(
        """
process = server.fork()
process.connection.send("1 / 0")
print(server.wait(process))
"""
    )
    assert out.split() == ["1"]


def test_the_end_of_the_prepared_process_is_told() -> None:
    out = run(
        """
process = server.fork()
process.connection.send("os.getppid()")
os.kill(process.connection.recv(), signal.SIGKILL)
for action in (server.fork, lambda: server.wait(process)):
    try:
        action()
    except ForkServerEndedError:
        print("ended")
"""
    )
    assert out.split() == ["ended", "ended"]


@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="only Linux ends the children of a killed process"
)
def test_all_processes_end_with_a_killed_worker() -> None:
    rest = """
process = server.fork()
process.connection.send("os.getppid()")
print(process.pid, process.connection.recv(), flush=True)
time.sleep(60)
"""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(rest=rest)], cwd=PROJECT, stdout=subprocess.PIPE, text=True
    ) as worker:
        assert worker.stdout is not None
        pids = [int(word) for word in worker.stdout.readline().split()]
        assert all(Path(f"/proc/{pid}").exists() for pid in pids)
        worker.kill()
    deadline = time.monotonic() + 30
    while any(running(pid) for pid in pids):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def running(pid: int) -> bool:
    """Return whether a process runs; one that has ended may still wait for its parent."""
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False
