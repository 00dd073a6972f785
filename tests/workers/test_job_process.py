"""Jobs in a process of their own, in a program of its own: the tests' process has threads.

The ends by a limit are tried with a whole worker (test_process.py).
"""

import subprocess
import sys

from tests.paths import PROJECT

PROGRAM = """
import os, signal, time
from settings import Settings
from tests.workers.echo import EchoHandler
from workers.attempt import LeaseLostError
from workers.job_process import JobProcess
from workers.registry import FilesWantedError, Registry
def wants():
    raise FilesWantedError(frozenset({"a1"}))
class Handler(EchoHandler):
    def run(self, work, progress):
        progress("run", 0.25)
        return eval(work) if work != "nothing" else super().run(work, progress)
jobs = JobProcess(Registry([Handler()]), Settings())
def run(work, progress=lambda *step: None, check=lambda: None):
    try:
        return jobs.run("echo", work, progress, check)
    except Exception as error:
        return f"{type(error).__name__} {getattr(error, 'code', '')}".strip()
"""


def run(rest: str) -> list[str]:
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM + rest],
        cwd=PROJECT,
        env={"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return [line for line in ended.stdout.splitlines() if "job_process_ended" not in line]  # the log


def test_one_process_runs_job_after_job_and_is_not_the_worker() -> None:
    assert run(
        """
first, second = (run("os.getpid()") for _ in range(2))
print(first == second, first == os.getpid())
steps = []
print(run("1 + 1", lambda *step: steps.append(step)), steps)
"""
    ) == ["True False", "2 [('run', 0.25)]"]


def test_a_refusal_keeps_the_process_and_a_defect_does_not() -> None:
    assert run(
        """
before = run("os.getpid()")
print(run("nothing"), run("os.getpid()") == before)
print(run("wants()"), run("os.getpid()") == before)
print(run("1 / 0"), run("os.getpid()") == before)
"""
    ) == ["JobRefusedError invalid-parameter True", "FilesWantedError True", "JobBrokeError False"]


def test_a_process_that_ends_is_replaced() -> None:
    assert run(
        """
print(run("os._exit(3)"), run("2 + 2"))
os.kill(run("os.getpid()"), signal.SIGKILL)  # between two jobs it is no fault of a job
time.sleep(0.5)
print(run("3 + 3"))
"""
    ) == ["JobCrashedError job-crashed 4", "6"]


def test_work_that_is_no_longer_wanted_is_ended() -> None:
    assert run(
        """
def lost(*_):
    raise LeaseLostError
before = run("os.getpid()")
print(run("time.sleep(60)", check=lost), run("time.sleep(60)", progress=lost), run("os.getpid()") == before)
"""
    ) == ["LeaseLostError LeaseLostError False"]


def test_without_the_prepared_process_the_worker_ends_and_no_job_fails() -> None:
    ended = subprocess.run(
        [
            sys.executable,
            "-c",
            PROGRAM + "print(run('os.kill(os.getppid(), signal.SIGKILL) or time.sleep(60)'))",
        ],
        cwd=PROJECT,
        env={"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (ended.returncode, "job_server_ended" in ended.stdout, "Error" in ended.stdout) == (
        69,
        True,
        False,
    )
