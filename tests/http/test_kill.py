"""A worker killed or stopped in the middle of a job loses nothing and doubles nothing."""

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from store.processes import REPORT_SECONDS
from store.queue import JobQueue
from tests.http.harness import Service, board, free_port, pair, stop, wait_for
from tests.http.test_run import COMMAND, children_of, environment
from tests.patience import PATIENCE_S

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


def beats_until_claimed(service: Service, job: str, worker: Process) -> int:
    """Return how often a worker reports until a job is claimed again: a busy machine delays the one with the other."""
    query = "SELECT last_seen FROM processes WHERE name LIKE ?"
    seen: set[object] = set()

    def claimed_again() -> bool:
        seen.update(at for (at,) in service.sql(query, f"%:{worker.pid}"))
        started = service.sql(
            "SELECT count(*) FROM events WHERE subject_id = ? AND action = 'job:started'", job
        )
        return started == [(2,)]

    wait_for(claimed_again, "the other worker to claim the job")
    assert seen
    return len(seen) - 1


def test_a_killed_worker_s_job_is_done_by_another_once(
    service: Service, surgery: str, calibration: str
) -> None:
    victim = service.start("worker")
    job = stop_mid_job(service, victim, stages(service, surgery, calibration))
    other = service.start("worker")
    wait_for(lambda: service.logged("worker_ready", f"pid={other.pid}"), "the other worker")
    victim.kill()
    beats = beats_until_claimed(service, job, other)
    assert beats * REPORT_SECONDS < 15  # the promise of docs/operations.md
    done = service.finished(job)
    assert (done["state"], done["attempts"]) == ("succeeded", 1)
    assert_measured_once(service, job)


def test_a_revived_worker_changes_nothing(service: Service, surgery: str, calibration: str) -> None:
    sleeper = service.start("worker", SPINEWATCH_LEASE_SECONDS="1")
    job = stop_mid_job(service, sleeper, stages(service, surgery, calibration))
    other = service.start("worker")
    done = service.finished(job)
    assert (done["state"], done["attempts"]) == ("succeeded", 1)
    os.kill(sleeper.pid, signal.SIGCONT)
    wait_for(lambda: service.logged("lease_lost", job), "the revived worker to notice")
    assert service.job(job) == done
    assert_measured_once(service, job)

    other.terminate()
    other.wait(PATIENCE_S)
    again = service.submit(surgery, "after", pair("POST"), calibration)
    assert service.finished(again)["state"] == "succeeded"  # the revived worker works on


def test_a_killed_worker_s_calibration_is_made_by_another_once(service: Service) -> None:
    victim = service.start("worker", SPINEWATCH_LEASE_SECONDS="1")
    job = stop_mid_job(service, victim, shots(service))
    assert service.job(job)["calibration_id"] is None
    service.start("worker")
    victim.kill()
    done = service.finished(job)
    assert (done["state"], done["attempts"]) == ("succeeded", 1)
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
    assert worker.wait(PATIENCE_S) == 0
    assert all(service.job(job)["state"] in {"queued", "succeeded"} for job in jobs)
    service.start("worker")
    assert {service.finished(job)["state"] for job in jobs} == {"succeeded"}
    assert all(service.job(job)["attempts"] == 1 for job in jobs)


def test_jobs_missing_from_the_queue_are_enqueued_again(
    service: Service, surgery: str, calibration: str
) -> None:
    jobs = [service.submit(surgery, f"S{n}", pair("PRE"), calibration) for n in range(2)]
    queue = JobQueue(service.queue_url)
    assert queue.waiting() == set(jobs)
    queue.huey.flush()
    queue.close()
    service.start("worker")
    assert {service.finished(job)["state"] for job in jobs} == {"succeeded"}


def test_a_backlog_of_one_surgery_delays_another_by_the_jobs_in_hand_only(
    service: Service, calibration: str
) -> None:
    busy, calm = service.surgery(), service.surgery()
    backlog = [service.submit(busy, f"S{n}", pair("PRE"), calibration) for n in range(8)]
    own = service.submit(calm, "PRE", pair("PRE"), calibration)
    service.start("worker")
    for job in (*backlog, own):
        service.finished(job)
    started = service.sql(
        "SELECT subject_id FROM events WHERE action = 'job:started' AND surgery_id IN (?, ?) ORDER BY seq",
        busy,
        calm,
    )
    order = [job for (job,) in started if job in {own, *backlog}]
    assert order.index(own) <= 1
    assert [job for job in order if job != own] == backlog


def test_a_process_that_gives_no_sign_of_life_is_replaced(tmp_path: Path) -> None:
    output = tmp_path / "out.txt"
    settings = environment(tmp_path, SPINEWATCH_WATCHDOG_SECONDS="5")
    arguments = [*COMMAND, "run", "--port", str(free_port()), "--workers", "1"]
    with output.open("wb") as out:
        run = subprocess.Popen(arguments, env=settings, stdin=subprocess.DEVNULL, stdout=out, stderr=out)
    try:
        for word in ("Spinewatch serves", "worker_ready"):
            wait_for(lambda word=word: word in output.read_text(), word)  # type: ignore[misc]
        for name in ("worker", "serve"):
            before = process_named(run, name)
            assert before is not None
            time.sleep(1)  # signs of life come twice a second
            os.kill(before, signal.SIGSTOP)
            wait_for(lambda b=before, n=name: process_named(run, n) not in {None, b}, "another one")  # type: ignore[misc]
        assert "process_silent" in output.read_text()  # a second one is left out of the log
    finally:
        run.terminate()
        run.wait(30)


def process_named(run: Process, command: str) -> int | None:
    """Return the child of a supervisor that runs a command."""
    return next((pid for pid, name in children_of(run).items() if name == command), None)
