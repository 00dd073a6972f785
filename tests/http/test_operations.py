"""Operation of the service: health, metrics, backups, an orderly end, and a database that another program holds."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest
from prometheus_client.parser import text_string_to_metric_families

from store.verification import verify
from tests.backends import about_the_sqlite_file, held_write_lock
from tests.http.harness import Service, code_of, pair, problem_of, wait_for

pytestmark = pytest.mark.timeout(300)  # many processes are started, which takes long on a busy machine

HELD_S = 25.0
"""Twice as long as a transaction waits, and five leases."""


def command(service: Service, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "commands", *words],
        env={**os.environ, **service.environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )


def readiness(service: Service) -> dict[str, Any]:
    document: dict[str, Any] = service.client.get("/health/ready").json()
    return document


def failed(document: dict[str, Any]) -> set[str]:
    return {check["name"] for check in document["checks"] if not check["ok"]}


def is_ready(service: Service) -> bool:
    return service.client.get("/health/ready").status_code == 200


def metrics(service: Service) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    answer = service.client.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=")
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(answer.text)
        for sample in family.samples
    }


def end(process: subprocess.Popen[bytes]) -> int:
    process.send_signal(signal.SIGTERM)
    return process.wait(30)


def test_liveness_needs_no_key_and_names_the_server(tmp_path: Path) -> None:
    with Service(tmp_path, SPINEWATCH_INSTANCE_ID="cart-7") as service:
        answer = httpx.get(f"{service.client.base_url}/health/live", trust_env=False)
        assert answer.status_code == 200
        assert (answer.json()["status"], answer.json()["instance"]) == ("live", "cart-7")


def test_the_service_is_ready_while_a_worker_runs(tmp_path: Path) -> None:
    with Service(tmp_path, SPINEWATCH_MIN_FREE_BYTES="0") as service:
        problem = problem_of(service.client.get("/health/ready"), 503)
        assert problem["type"].endswith(":not-ready")
        assert failed(problem) == {"workers"}
        assert all({"figure", "limit", "unit"} <= set(check) for check in problem["checks"])
        assert "workers: no worker has reported" in problem["detail"]
        worker = service.start("worker")
        wait_for(lambda: is_ready(service), "the worker to report")
        document = readiness(service)
        assert failed(document) == set()
        assert all(check["detail"] for check in document["checks"])
        assert end(worker) == 0
        wait_for(lambda: not is_ready(service), "the end of the worker to be known")
        killed = service.start("worker")
        wait_for(lambda: is_ready(service), "the other worker to report")
        killed.kill()
        killed.wait()
        wait_for(lambda: not is_ready(service), "the worker to be missed")


def test_readiness_fails_while_nothing_can_be_written_and_liveness_does_not(service: Service) -> None:
    with held_write_lock(service.database_url), ThreadPoolExecutor(1) as pool:
        asked = pool.submit(readiness, service)
        assert service.client.get("/health/live").status_code == 200
        document = asked.result(60)
    assert "database" in failed(document)
    assert any("lock" in check["detail"] for check in document["checks"])


def test_metrics_have_requests_jobs_steps_and_drift(service: Service, measured: str) -> None:
    calibration = service.client.get(f"/v1/surgeries/{measured}/stages/PRE").json()["calibration_id"]
    wait_for(lambda: metrics(service).get(("spinewatch_workers", ()), 0) >= 1, "the workers to report")
    found = metrics(service)
    stages = (("method", "POST"), ("route", "/v1/surgeries/{surgery_id}/stages"), ("status", "202"))
    assert found["spinewatch_http_requests_total", stages] >= 3
    assert found["spinewatch_http_request_seconds_count", stages[:2]] >= 3
    assert found["spinewatch_jobs", (("state", "succeeded"),)] >= 3
    for step in ("detect", "match", "label"):
        labels = (("kind", "stage"), ("step", step))
        assert found["spinewatch_step_seconds_sum", labels] > 0
        longest = (labels[0], ("le", "60.0"), labels[1])
        assert (
            3
            <= found["spinewatch_step_seconds_bucket", longest]
            <= found["spinewatch_step_seconds_count", labels]
        )
    drift = {
        labels: value for (name, labels), value in found.items() if name == "spinewatch_calibration_shift_mm"
    }
    assert any(("calibration", calibration) in labels for labels in drift)
    assert found["spinewatch_database_up", ()] == 1
    assert not any(measured in str(labels) for _, labels in found)


def test_polls_are_not_in_the_log_and_other_requests_are(service: Service) -> None:
    service.client.get("/health/live", headers={"X-Request-ID": "a-poll"})
    service.client.get("/v1/surgeries", headers={"X-Request-ID": "a-request"})
    wait_for(lambda: service.logged("a-request"), "the line of the request")
    assert service.logged("a-request", "status=200", "key=")
    assert not service.logged("a-poll")


@about_the_sqlite_file
def test_a_backup_made_under_uploads_without_pause_is_whole(service: Service, tmp_path: Path) -> None:
    surgery, calibration = service.surgery(), service.calibration()
    stop = threading.Event()
    images = pair("PRE")
    copy = tmp_path / "copy.sqlite"

    def upload() -> None:
        n = 0
        while not stop.is_set():
            service.submit(surgery, f"B{n}", images, calibration)
            n += 1

    with ThreadPoolExecutor(1) as pool:
        uploads = pool.submit(upload)
        try:
            done = command(service, "backup", str(copy))
        finally:
            stop.set()
        uploads.result(60)
    assert (done.returncode, done.stderr) == (0, "")
    checked = command(service, "verify", str(copy))
    assert (checked.returncode, checked.stderr) == (0, "")
    assert "the backup is whole" in checked.stdout
    refused = command(service, "restore", "--replace", str(copy))
    assert refused.returncode == 2
    assert "stop the service" in refused.stderr


@about_the_sqlite_file
def test_a_plain_copy_after_an_orderly_stop_is_whole(tmp_path: Path) -> None:
    folder = tmp_path / "service"
    folder.mkdir()
    with Service(folder) as service:
        worker = service.start("worker")
        surgery, calibration = service.surgery(), service.calibration()
        job = service.submit(surgery, "PRE", pair("PRE"), calibration)
        assert service.finished(job)["state"] == "succeeded"
        end(service.server)
        assert end(worker) == 0
        copy = tmp_path / "copy.sqlite"
        shutil.copyfile(service.database, copy)
    found = verify(copy)
    assert (found.problems, found.surgeries, found.stages, found.images) == ((), 1, 1, 2)


@about_the_sqlite_file
def test_what_is_restored_is_served(tmp_path: Path) -> None:
    folder = tmp_path / "service"
    folder.mkdir()
    copy = tmp_path / "copy.sqlite"
    with Service(folder) as service:
        first = service.surgery()
        assert command(service, "backup", str(copy)).returncode == 0
        second = service.surgery()
        end(service.server)
        done = command(service, "restore", "--replace", str(copy))
        assert done.returncode == 0, done.stderr
        assert "is kept as" in done.stdout
        service.start("serve")
        wait_for(service.ready, "the service")
        assert service.client.get(f"/v1/surgeries/{first}").status_code == 200
        assert code_of(service.client.get(f"/v1/surgeries/{second}"), 404) == "surgery-not-found"


def test_a_database_that_is_held_is_503_and_the_running_job_still_ends(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        service.start("worker")
        surgery, calibration = service.surgery(), service.calibration()
        job = service.submit(surgery, "PRE", pair("PRE"), calibration)
        service.started(job)
        released = threading.Event()
        with held_write_lock(service.database_url), ThreadPoolExecutor(1) as pool:
            pool.submit(released.wait, HELD_S)
            answer = service.send(surgery, "POST", pair("POST"), calibration)
            assert code_of(answer, 503) == "database-unavailable"
            assert int(answer.headers["Retry-After"]) >= 1
            assert service.client.get(f"/v1/jobs/{job}").status_code == 200
        ended = service.finished(job)
        assert (ended["state"], ended["attempts"]) == ("succeeded", 1)
        again = service.submit(surgery, "POST", pair("POST"), calibration)
        assert service.finished(again)["state"] == "succeeded"
        assert len(service.log.read_bytes()) < 100_000


@about_the_sqlite_file
def test_a_queue_file_that_breaks_delays_nothing_for_long(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        surgery, calibration = service.surgery(), service.calibration()
        jobs = [service.submit(surgery, name, pair(name), calibration) for name in ("PRE", "INTER")]
        for path in (service.queue, service.queue.with_name(f"{service.queue.name}-wal")):
            path.write_bytes(b"SQLite format 3\0" + b"\xff" * 20_000)
        service.start("worker")
        assert [service.finished(job)["state"] for job in jobs] == ["succeeded"] * 2
        late = service.submit(surgery, "POST", pair("POST"), calibration)
        assert service.finished(late)["state"] == "succeeded"
