import asyncio
from collections.abc import Iterator
from math import inf
from pathlib import Path

import pytest
from prometheus_client import CollectorRegistry
from prometheus_client.parser import text_string_to_metric_families

from migrations.history import upgrade
from service.metrics import Metrics, RequestMetrics, server_registry
from settings import Settings
from store import processes, step_times
from store.database import Database
from store.processes import ProcessKind
from store.queue import JobQueue
from tests.store.builders import RIG_CHECK, claimed, new_stage, new_surgery, stage_result, succeed

Samples = dict[tuple[str, tuple[tuple[str, str], ...]], float]


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(database_url=f"sqlite:///{tmp_path / 'x.sqlite'}")


@pytest.fixture
def database(settings: Settings) -> Iterator[Database]:
    upgrade(settings.database_url)
    database = Database(settings.database_url)
    yield database
    database.close()


def samples(text: bytes) -> Samples:
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(text.decode())
        for sample in family.samples
    }


def scraped(database: Database, settings: Settings, registry: CollectorRegistry | None = None) -> Samples:
    queue = JobQueue(settings.queue)
    try:
        metrics = Metrics(database, queue, settings, registry or server_registry())
        return samples(asyncio.run(metrics.text()))
    finally:
        queue.close()


def test_requests_are_counted_and_timed_by_route() -> None:
    registry = CollectorRegistry()
    requests = RequestMetrics(registry)
    requests.add("GET", "/v1/jobs/{job_id}", 200, 0.02)
    requests.add("GET", "/v1/jobs/{job_id}", 200, 4.0)
    requests.add("GET", None, 404, 0.001)
    for n in range(20):
        requests.add(f"MADE-UP-{n}", None, 405, 0.001)
    labels = {"method": "GET", "route": "/v1/jobs/{job_id}"}
    assert registry.get_sample_value("spinewatch_http_requests_total", {**labels, "status": "200"}) == 2
    assert registry.get_sample_value("spinewatch_http_request_seconds_bucket", {**labels, "le": "0.025"}) == 1
    assert registry.get_sample_value("spinewatch_http_request_seconds_sum", labels) == pytest.approx(4.02)
    made_up = {"method": "other", "route": "other", "status": "405"}
    assert registry.get_sample_value("spinewatch_http_requests_total", made_up) == 20


def test_the_record_is_shown_as_it_is(database: Database, settings: Settings) -> None:
    surgery = new_surgery(database)
    measured = new_stage(database, surgery, "PRE")
    result = stage_result(
        rig_check={**RIG_CHECK, "shift_mm": [0.0, 3.0, 4.0], "rotation_deg": [0.0, -0.2, 0.1]}
    )
    succeed(database, claimed(database, measured.job.id), 0, result)
    new_stage(database, surgery, "POST")
    with database.write() as session:
        processes.report(session, "w", ProcessKind.WORKER, "host:1")
        step_times.add(session, "stage", {"detect": 1.5})
        step_times.add(session, "stage", {"detect": 0.2})
    queue = JobQueue(settings.queue)
    queue.enqueue("a")
    queue.enqueue("b")
    queue.close()
    found = scraped(database, settings)
    rig = (("calibration", measured.calibration_id), ("rig", "dev_large"))
    step = (("kind", "stage"), ("step", "detect"))
    assert found["spinewatch_database_up", ()] == 1
    assert found["spinewatch_workers", ()] == 1
    assert found["spinewatch_queue_messages", ()] == 2
    assert found["spinewatch_queue_oldest_seconds", ()] > 0
    assert found["spinewatch_disk_free_bytes", ()] > 0
    assert found["spinewatch_jobs", (("state", "succeeded"),)] == 1
    assert found["spinewatch_jobs", (("state", "queued"),)] == 1
    assert found["spinewatch_jobs", (("state", "failed"),)] == 0
    buckets = {
        float(dict(labels)["le"]): value
        for (name, labels), value in found.items()
        if name == "spinewatch_step_seconds_bucket"
    }
    assert tuple(sorted(buckets)) == (*step_times.BOUNDS_S, inf)
    assert buckets == {bound: (bound >= 0.25) + (bound >= 2.5) for bound in buckets}
    assert found["spinewatch_step_seconds_count", step] == 2
    assert found["spinewatch_step_seconds_sum", step] == pytest.approx(1.7)
    assert found["spinewatch_calibration_shift_mm", rig] == 5
    assert found["spinewatch_calibration_rotation_deg", rig] == 0.2
    assert found["process_resident_memory_bytes", ()] > 0
    assert any(name == "spinewatch_info" for name, _ in found)


def test_a_scrape_answers_what_it_can_without_a_database(settings: Settings, tmp_path: Path) -> None:
    (tmp_path / "x.sqlite").write_bytes(b"broken" * 500)
    database = Database(settings.database_url)
    found = scraped(database, settings)
    database.close()
    assert found["spinewatch_database_up", ()] == 0
    assert found["spinewatch_queue_messages", ()] == 0
    assert ("spinewatch_workers", ()) not in found
