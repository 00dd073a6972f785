"""The check that a session leaves no process behind finds those that it should."""

import os
import subprocess
import sys

from tests.processes import left_behind

_SLEEP = [sys.executable, "-c", "import time; time.sleep(600)"]
_ORPHAN = (
    "import subprocess, sys; print(subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL).pid, flush=True)"
)


def test_a_child_is_found_until_it_ends(no_process_stays: str) -> None:
    process = subprocess.Popen(_SLEEP)
    try:
        assert any(line.startswith(f"{process.pid} ") for line in left_behind(no_process_stays, 0))
    finally:
        process.kill()
        process.wait()
    assert not any(line.startswith(f"{process.pid} ") for line in left_behind(no_process_stays, 0))


def test_a_process_whose_parent_has_ended_is_found(no_process_stays: str) -> None:
    started = subprocess.run(
        [sys.executable, "-c", _ORPHAN, *_SLEEP], stdout=subprocess.PIPE, check=True, text=True
    )
    pid = int(started.stdout)
    try:
        assert any(line.startswith(f"{pid} ") for line in left_behind(no_process_stays, 0))
    finally:
        os.kill(pid, 9)
