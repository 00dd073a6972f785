"""The memory of a worker process: its limit, and freed memory that the next image reuses."""

import subprocess
import sys

import pytest

from tests.paths import PROJECT

MIB = 1024 * 1024
FAULTS = """
import resource
import numpy as np
from workers.memory import keep_freed_memory
{first}
def image():
    planes = [np.ones(1_000_000, np.uint8) for _ in range(6)]
for _ in range(5):
    image()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    image()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def python(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=PROJECT,
        env={"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )


def faults(first: str) -> int:
    """Return the number of page faults while memory is allocated and freed, in a process of its own."""
    return int(python(FAULTS.format(first=first)).stdout)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only glibc can be told to keep memory")
def test_freed_memory_is_kept() -> None:
    fresh, kept = faults(""), faults("keep_freed_memory()")
    assert kept < 0.1 * fresh


def test_a_process_cannot_take_more_memory_than_its_limit() -> None:
    ended = python(
        f"from workers.memory import limit_memory; limit_memory({600 * MIB}); bytearray({700 * MIB})"
    )
    assert ended.returncode == 1
    assert "MemoryError" in ended.stderr
