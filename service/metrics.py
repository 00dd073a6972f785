"""Metrics of the service in the text format of Prometheus."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from itertools import accumulate

import structlog
from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Histogram,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import GaugeMetricFamily, HistogramMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from contract.job import JobState
from service.shared_run import SharedRun
from settings import Settings
from store import figures, processes, step_times
from store.database import Database, sqlite_path
from store.figures import Drift
from store.processes import ProcessKind
from store.queue import JobQueue
from store.step_times import StepHistogram

MEDIA_TYPE = CONTENT_TYPE_LATEST
"""Media type of the metrics."""

_BUCKETS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
_OTHER = "other"
_KEPT_SECONDS = 2.0
_log = structlog.get_logger("service")


class RequestMetrics:
    """Counts and times requests by the declared path of their route; paths without one share a label."""

    def __init__(self, registry: CollectorRegistry) -> None:
        labels = ["method", "route"]
        self._requests = Counter(
            "spinewatch_http_requests", "Requests answered.", [*labels, "status"], registry=registry
        )
        self._seconds = Histogram(
            "spinewatch_http_request_seconds",
            "Time until the answer was sent.",
            labels,
            buckets=_BUCKETS,
            registry=registry,
        )

    def add(self, method: str, route: str | None, status: int, seconds: float) -> None:
        """Count a request; ``route`` is its declared path, None when it has none."""
        labels = (method if method in _METHODS else _OTHER, route or _OTHER)
        self._requests.labels(*labels, str(status)).inc()
        self._seconds.labels(*labels).observe(seconds)


@dataclass(frozen=True)
class _Figures:
    """What the database and the queue had a short time ago; None where they did not answer."""

    up: bool = False
    jobs: Mapping[JobState, int] = field(default_factory=dict)
    oldest_seconds: float | None = None
    workers: int | None = None
    steps: Sequence[StepHistogram] = ()
    drifts: Sequence[Drift] = ()
    messages: int | None = None


class Metrics:
    """All metrics of a server: of its requests, and of the record as it is."""

    def __init__(
        self, database: Database, queue: JobQueue, settings: Settings, registry: CollectorRegistry
    ) -> None:
        self._registry = registry
        self._database = database
        self._queue = queue
        self._disk = sqlite_path(settings.database_url)
        self._figures = SharedRun(self._read, _KEPT_SECONDS)

    async def text(self) -> bytes:
        """Return the metrics; figures of the record may be two seconds old."""
        record = CollectorRegistry()
        record.register(_Record(await self._figures.result(), self._free_bytes()))
        return generate_latest(self._registry) + generate_latest(record)

    def _free_bytes(self) -> int | None:
        try:
            return None if self._disk is None else shutil.disk_usage(self._disk.parent).free
        except OSError:
            return None

    def _read(self) -> _Figures:
        try:
            messages = self._queue.length()
        except Exception:  # of whatever the queue is stored in
            messages = None
        try:
            with self._database.read() as session:
                return _Figures(
                    up=True,
                    jobs=figures.jobs_by_state(session),
                    oldest_seconds=figures.queue_seconds(session),
                    workers=len(processes.alive(session, ProcessKind.WORKER)),
                    steps=step_times.listed(session),
                    drifts=figures.drifts(session),
                    messages=messages,
                )
        except Exception as error:  # a scrape answers what it can
            _log.warning("metrics_incomplete", error=type(error).__name__)
            return _Figures(messages=messages)


def server_registry() -> CollectorRegistry:
    """Return a registry of this process: version, memory, processor time and open files."""
    registry = CollectorRegistry()
    ProcessCollector(registry=registry)
    registry.register(_Info())
    return registry


class _Info(Collector):
    """The version, as a label."""

    def collect(self) -> Iterator[Metric]:
        yield _gauge(
            "spinewatch_info", "Version of Spinewatch.", [((version("spinewatch"),), 1)], ["version"]
        )


class _Record(Collector):
    """Figures of the record."""

    def __init__(self, found: _Figures, free_bytes: int | None) -> None:
        self._found = found
        self._free_bytes = free_bytes

    def collect(self) -> Iterator[Metric]:
        found = self._found
        yield _gauge("spinewatch_database_up", "1 while the database answers.", [((), int(found.up))])
        yield _gauge("spinewatch_queue_messages", "Messages that wait for a worker.", [((), found.messages)])
        yield _gauge(
            "spinewatch_queue_oldest_seconds",
            "Time that the oldest queued job has waited.",
            [((), found.oldest_seconds)],
        )
        yield _gauge("spinewatch_workers", "Worker processes that reported recently.", [((), found.workers)])
        yield _gauge(
            "spinewatch_disk_free_bytes", "Free space of the database's disk.", [((), self._free_bytes)]
        )
        states = [((state.value,), count) for state, count in found.jobs.items()]
        yield _gauge("spinewatch_jobs", "Jobs by state.", states, ["state"])
        yield _steps(found.steps)
        labels = ["calibration", "rig"]
        shift = [((drift.calibration_id, drift.name), drift.shift_mm) for drift in found.drifts]
        rotation = [((drift.calibration_id, drift.name), drift.rotation_deg) for drift in found.drifts]
        yield _gauge("spinewatch_calibration_shift_mm", "Shift of the rig at its last stage.", shift, labels)
        yield _gauge(
            "spinewatch_calibration_rotation_deg",
            "Largest rotation of the rig at its last stage.",
            rotation,
            labels,
        )


def _steps(steps: Sequence[StepHistogram]) -> Metric:
    family = HistogramMetricFamily(
        "spinewatch_step_seconds", "Time of each step of the jobs that succeeded.", labels=["kind", "step"]
    )
    bounds = [*map(str, step_times.BOUNDS_S), "+Inf"]
    for step in steps:
        buckets = list(zip(bounds, map(float, accumulate(step.counts)), strict=True))
        family.add_metric([step.kind, step.step], buckets, step.seconds)
    return family


def _gauge(
    name: str,
    help_text: str,
    values: Iterable[tuple[tuple[str, ...], float | None]],
    labels: Sequence[str] = (),
) -> Metric:
    """Return a gauge; a value that is None is left out."""
    gauge = GaugeMetricFamily(name, help_text, labels=labels)
    for key, value in values:
        if value is not None:
            gauge.add_metric(key, value)
    return gauge
