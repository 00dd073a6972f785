"""The loop of a job's process, in a thread with a connection, and its limits in a process of its own."""

import subprocess
import sys
from multiprocessing import Pipe
from typing import Any

import pytest

from tests.paths import PROJECT
from tests.workers.echo import EchoHandler
from workers.job_loop import Broke, OutOfMemory, Progressed, Refused, Returned, Waits, WantsFiles
from workers.registry import FilesWantedError, NotReadyError

PROGRAM = """
import sys
from multiprocessing import Pipe
from threading import Thread
from tests.workers.test_job_loop import Eager
from workers.job_loop import run_jobs
from workers.registry import Registry
ours, theirs = Pipe()
thread = Thread(target=run_jobs, args=(theirs, Registry([Eager()]), 3 << 30, 60.0), daemon=True)
thread.start()
for word in sys.argv[1:]:
    ours.send(("echo", word))
    while type(answer := ours.recv()).__name__ == "Progressed":
        print(repr(answer))
    print(repr(answer).replace(chr(10), " "))
ours.close()
thread.join()
"""


class Eager(EchoHandler):
    """A handler that can do more than repeat."""

    def run(self, work: str, progress: Any) -> str:
        match work:
            case "much":
                bytearray(8 << 30)
            case "wait":
                raise NotReadyError("other")
            case "file":
                raise FilesWantedError(frozenset({"a1"}))
            case "break":
                raise ZeroDivisionError("a defect")
        return super().run(work, progress)

    def pack(self, result: str) -> str:
        return f"packed {result}"


def answers(*words: str) -> list[str]:
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words],
        cwd=PROJECT,
        env={"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.splitlines()


def test_each_job_has_an_answer_and_the_next_one_follows() -> None:
    assert answers("a", "nothing", "wait", "file", "much", "b") == [
        repr(Progressed("repeat", 0.5)),
        repr(Returned("packed a a")),
        repr(Progressed("repeat", 0.5)),
        repr(Refused("invalid-parameter", "there is no word to repeat; give one")),
        repr(Waits("other")),
        repr(WantsFiles(frozenset({"a1"}))),
        repr(OutOfMemory()),
        repr(Progressed("repeat", 0.5)),
        repr(Returned("packed b b")),
    ]


def test_a_defect_is_reported_with_its_traceback() -> None:
    (line,) = answers("break")
    assert line.startswith(Broke.__name__)
    assert "ZeroDivisionError: a defect" in line
    assert "test_job_loop" in line


@pytest.mark.parametrize(
    "message",
    [
        Progressed("s", 0.5),
        Returned([1]),
        Refused("c", "d"),
        Waits("j"),
        WantsFiles(frozenset({"a1"})),
        OutOfMemory(),
    ],
)
def test_messages_travel_unchanged(message: object) -> None:
    ours, theirs = Pipe()
    ours.send(message)
    assert theirs.recv() == message
    ours.close()
    theirs.close()
