"""The memory of a worker process: what a picture has freed the next one finds again."""

import subprocess
import sys

import pytest

from tests.paths import PROJECT

FAULTS = """
import resource
import numpy as np
from workers.process import keep_freed_memory
{first}
def picture():
    planes = [np.ones(1_000_000, np.uint8) for _ in range(6)]
for _ in range(5):
    picture()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    picture()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def faults(first: str) -> int:
    """Return how many pages were faulted in while memory was taken and freed, in a process of its own."""
    code = FAULTS.format(first=first)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=PROJECT, capture_output=True, text=True, check=True
    )
    return int(done.stdout)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only glibc is told to keep memory")
def test_freed_memory_is_kept() -> None:
    fresh, kept = faults(""), faults("keep_freed_memory()")
    assert kept < 0.1 * fresh
