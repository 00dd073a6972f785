"""A process that sleeps is told from one that works or is kept from a core."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

from tests.sleep import slept_until_exit_s

WORKS = "import time\nwhile time.process_time() < 0.3: pass"
SLEEPS = "import time\ntime.sleep(2)"


def slept_s(program: str) -> float:
    with subprocess.Popen([sys.executable, "-c", program]) as process:
        return slept_until_exit_s(process.pid)


def test_sleep_counts_and_work_does_not_although_others_work() -> None:
    with ThreadPoolExecutor(4) as threads:
        works = list(threads.map(slept_s, [WORKS] * 4))
    assert max(works) < 1.0
    assert slept_s(SLEEPS) > 1.5
