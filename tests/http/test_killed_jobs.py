"""A job whose process is killed again and again, as by a kernel short of memory, fails by name; others are done."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest

from tests.http.harness import FINAL, Service, pair, wait_for
from tests.http.test_stages import encoded

ATTEMPTS = 3
"""The default of SPINEWATCH_MAX_ATTEMPTS."""


@pytest.fixture
def service(idle: Service) -> Service:
    return idle


def submit_long_job(service: Service, surgery: str, calibration: str) -> str:
    """Submit a burst of pairs of noise, which are measured for seconds."""
    images = np.random.default_rng(7).integers(0, 256, (24, 416, 568), np.uint8)
    parts = [
        (("left", "right")[number % 2], ("x", encoded(image, "PNG"))) for number, image in enumerate(images)
    ]
    answer = service.client.post(
        f"/v1/surgeries/{surgery}/stages", data={"name": "LONG", "calibration_id": calibration}, files=parts
    )
    assert answer.status_code == 202, answer.text
    return str(answer.headers["Location"].removeprefix("/v1/jobs/"))


def test_a_job_whose_process_is_killed_each_time_fails_by_name(service: Service) -> None:
    calibration = service.calibration()
    job = submit_long_job(service, service.surgery(), calibration)
    others = [service.submit(service.surgery(), "PRE", pair("PRE"), calibration) for _ in range(3)]
    worker = service.start("worker")
    try:
        kills = kill_while_running(service, worker.pid, job)
        done = service.job(job)
        assert kills >= ATTEMPTS  # a kill may come between two jobs, which is no fault of either
        assert (done["state"], done["attempts"]) == ("failed", ATTEMPTS)
        assert done["error"]["type"].endswith(":attempts-exhausted")
        assert "workers' log" in done["error"]["detail"]
        assert [service.finished(other)["state"] for other in others] == ["succeeded"] * len(others)
        assert worker.poll() is None
    finally:
        service.kill_workers()


def kill_while_running(service: Service, worker: int, job: str) -> int:
    """Kill the process of a job in each of its attempts until it has ended; return how often."""
    killed: set[int] = set()

    def ended() -> bool:
        state = service.job(job)["state"]
        if state == "running":
            for server in children_of(worker):
                for process in children_of(server) - killed:
                    if service.job(job)["state"] == "running":
                        os.kill(process, signal.SIGKILL)
                        killed.add(process)
        return state in FINAL

    wait_for(ended, "the job to end")
    return len(killed)


def children_of(pid: int) -> set[int]:
    return {int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()}
