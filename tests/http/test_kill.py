"""A worker killed or stopped in the middle of a job loses nothing and doubles nothing."""

import os
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable, Iterator

import pytest

from tests.http.harness import Service, board, pair, stop, wait_for

Process = subprocess.Popen[bytes]


@pytest.fixture(scope="module")
def service(idle: Service) -> Service:
    return idle


@pytest.fixture(autouse=True)
def no_worker_stays(service: Service) -> Iterator[None]:
    yield
    service.kill_workers()


def stop_mid_job(service: Service, worker: Process, submit: Callable[[int], str]) -> str:
    """Submit jobs until the worker is stopped (SIGSTOP) with one in hand; return that job's id.

    A worker that is stopped while it writes would block the database or the queue for all others; it is then
    continued.
    """
    for number in range(50):
        job = submit(number)
        service.started(job)
        stop(worker)
        if service.write_locks_are_free() and service.job(job)["state"] == "running":
            return job
        os.kill(worker.pid, signal.SIGCONT)
        service.finished(job)
    raise AssertionError("no job was caught running")


def stages(service: Service, surgery: str, calibration: str) -> Callable[[int], str]:
    return lambda number: service.submit(surgery, f"S{number}", pair("PRE"), calibration)


def shots(service: Service) -> Callable[[int], str]:
    return lambda _: str(service.shoot(board("C"), board("A"), verify="1").json()["id"])


def assert_calibrated_once(service: Service, job: str) -> None:
    ((request,),) = service.sql("SELECT subject_id FROM jobs WHERE id = ?", job)
    for table, key in (("calibrations", "id"), ("calibration_reports", "calibration_id")):
        assert service.sql(f"SELECT count(*) FROM {table} WHERE {key} = ?", request) == [(1,)]  # noqa: S608
    assert service.events(job, request) == [
        "http:calibration:submitted",
        "worker:job:started",
        "worker:job:started",
        "worker:calibration:solved",
    ]


def assert_measured_once(service: Service, job: str) -> None:
    ((stage,),) = service.sql("SELECT subject_id FROM jobs WHERE id = ?", job)
    counts = {
        table: service.sql(f"SELECT count(*) FROM {table} WHERE stage_id = ?", stage)[0][0]  # noqa: S608
        for table in ("measurements", "features", "triads")
    }
    assert counts == {"measurements": 1, "features": 2, "triads": 4}
    assert service.events(job, stage) == [
        "http:stage:submitted",
        "worker:job:started",
        "worker:job:started",
        "worker:stage:measured",
    ]


def test_a_killed_worker_s_job_is_done_by_another_once(
    service: Service, surgery: str, calibration: str
) -> None:
    victim = service.start("worker")
    job = stop_mid_job(service, victim, stages(service, surgery, calibration))
    other = service.start("worker")
    wait_for(lambda: service.logged("worker_ready", f"pid={other.pid}"), "the other worker")
    victim.kill()
    killed = time.monotonic()
    done = service.finished(job)
    assert time.monotonic() - killed < 15  # the promise of docs/operations.md
    assert (done["state"], done["attempts"]) == ("succeeded", 2)
    assert_measured_once(service, job)


def test_a_revived_worker_changes_nothing(service: Service, surgery: str, calibration: str) -> None:
    sleeper = service.start("worker", SPINEWATCH_LEASE_SECONDS="1")
    job = stop_mid_job(service, sleeper, stages(service, surgery, calibration))
    other = service.start("worker")
    done = service.finished(job)
    assert (done["state"], done["attempts"]) == ("succeeded", 2)
    os.kill(sleeper.pid, signal.SIGCONT)
    wait_for(lambda: service.logged("lease_lost", job), "the revived worker to notice")
    assert service.job(job) == done
    assert_measured_once(service, job)

    other.terminate()
    other.wait(10)
    again = service.submit(surgery, "after", pair("POST"), calibration)
    assert service.finished(again)["state"] == "succeeded"  # the revived worker works on


def test_a_killed_worker_s_calibration_is_made_by_another_once(service: Service) -> None:
    victim = service.start("worker", SPINEWATCH_LEASE_SECONDS="1")
    job = stop_mid_job(service, victim, shots(service))
    assert service.job(job)["calibration_id"] is None
    service.start("worker")
    victim.kill()
    done = service.finished(job)
    assert (done["state"], done["attempts"]) == ("succeeded", 2)
    assert_calibrated_once(service, job)


def test_a_revived_worker_makes_no_second_calibration(service: Service) -> None:
    sleeper = service.start("worker", SPINEWATCH_LEASE_SECONDS="1")
    job = stop_mid_job(service, sleeper, shots(service))
    service.start("worker")
    done = service.finished(job)
    os.kill(sleeper.pid, signal.SIGCONT)
    wait_for(lambda: service.logged("lease_lost", job), "the revived worker to notice")
    assert service.job(job) == done
    assert_calibrated_once(service, job)


def test_a_cancelled_job_that_was_running_leaves_no_result(
    service: Service, surgery: str, calibration: str
) -> None:
    worker = service.start("worker")
    job = stop_mid_job(service, worker, stages(service, surgery, calibration))
    service.client.post(f"/v1/jobs/{job}/cancel")
    os.kill(worker.pid, signal.SIGCONT)
    wait_for(lambda: service.logged("lease_lost", job), "the worker to notice")
    assert service.job(job)["state"] == "cancelled"
    ((stage,),) = service.sql("SELECT subject_id FROM jobs WHERE id = ?", job)
    assert service.sql("SELECT count(*) FROM measurements WHERE stage_id = ?", stage) == [(0,)]


def test_a_terminated_worker_requeues_its_job_or_finishes_it(
    service: Service, surgery: str, calibration: str
) -> None:
    worker = service.start("worker")
    jobs = [service.submit(surgery, f"S{n}", pair("PRE"), calibration) for n in range(3)]
    service.started(jobs[0])
    worker.terminate()
    assert worker.wait(10) == 0
    assert all(service.job(job)["state"] in {"queued", "succeeded"} for job in jobs)
    service.start("worker")
    assert {service.finished(job)["state"] for job in jobs} == {"succeeded"}
    assert all(service.job(job)["attempts"] == 1 for job in jobs)


def test_jobs_missing_from_the_queue_are_enqueued_again(
    service: Service, surgery: str, calibration: str
) -> None:
    jobs = [service.submit(surgery, f"S{n}", pair("PRE"), calibration) for n in range(2)]
    with sqlite3.connect(service.queue) as queue:
        assert queue.execute("DELETE FROM task").rowcount == 2
    queue.close()
    service.start("worker")
    assert {service.finished(job)["state"] for job in jobs} == {"succeeded"}
