"""The summary of a surgery in a large record, and how much the database grows per stage."""

from __future__ import annotations

import http.client
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from statistics import median
from typing import Any, cast
from urllib.parse import urlsplit

import numpy as np
from sqlalchemy import select, text, update
from sqlalchemy.orm import Session

from bench.load_cart import Cart, milliseconds
from bench.load_pairs import make_pairs, spine_document
from bench.load_service import LoadService, ServiceStuckError
from bench.tables import Bar, Grid
from contract.event import Actor, ActorKind
from contract.job import JobState
from contract.spine import StageSpine
from contract.spine_setup import SpineSetup
from contract.stage import StageResult
from contract.surgery import NewSurgery
from service.routes.summary import summary_json
from spinewatch.imaging.header import ImageHeader
from store import (
    calibrations,
    images,
    measurements,
    spine_setups,
    spines,
    stage_submission,
    summaries,
    surgeries,
)
from store.clock import utc_now
from store.database import Database
from store.images import NewImage
from store.spines import ComputedSpine
from store.stage_submission import NewStage
from store.tables.images import Image
from store.tables.jobs import Job
from store.tables.stages import Stage

SURGERIES = 1000
STAGES = 10
REQUESTS = 1000
_LIMIT_MS = 10.0
_ACTOR = Actor(kind=ActorKind.COMMAND, name="bench.load")
_PATIENCE_S = 60.0
_POLL_S = 0.05


@dataclass(frozen=True)
class Summaries:
    """Time of summaries of surgeries chosen at random, and growth of the database.

    Attributes
    ----------
    surgeries, stages
        Size of the record: number of surgeries, and of stages of each.
    http
        Milliseconds from the request until the whole answer is there, over one connection.
    in_process
        Milliseconds of the query and of the document without HTTP.
    size_bytes
        Size of a summary.
    stage_bytes
        Growth of the database per stage, images included, and that of it which the images are.
    """

    surgeries: int
    stages: int
    http: Sequence[float]
    in_process: Sequence[float]
    size_bytes: int
    stage_bytes: tuple[float, float]

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bar and whether it is reached."""
        promise = f"summary at {self.surgeries} surgeries x {self.stages} stages: p99 < {_LIMIT_MS:.0f} ms"
        reached = _p99(self.http)
        return (Bar(promise, f"{reached:.1f} ms", reached < _LIMIT_MS),)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The tables."""
        title = (
            f"Summary ({self.size_bytes / 1024:.0f} kB) at {self.surgeries} surgeries x {self.stages} stages"
        )
        rows = [("over HTTP", *_row(self.http)), ("in process", *_row(self.in_process))]
        whole, files = self.stage_bytes
        growth = [("a stage", f"{whole / 1024:.0f}"), ("its images", f"{files / 1024:.0f}")]
        return (
            Grid.of(title, ["", "median ms", "p99 ms", "largest ms"], rows),
            Grid.of("Growth of the database", ["", "kB"], growth),
        )


def measure(
    service: LoadService, count: int = SURGERIES, requests: int = REQUESTS, seed: int = 3
) -> Summaries:
    """Measure one surgery, store it ``count`` times, and ask for summaries at random."""
    pattern, stage_bytes = _measured_surgery(service, seed)
    database = service.database()
    try:
        ids = fill(database, pattern, count)
        rng = np.random.default_rng(seed)
        chosen = [ids[k] for k in rng.integers(len(ids), size=requests)]
        over_http, size = _over_http(service, chosen)
        in_process = [milliseconds(partial(_in_process, database, surgery)) for surgery in chosen]
    finally:
        database.close()
    return Summaries(count, STAGES, over_http, in_process, size, stage_bytes)


@dataclass(frozen=True)
class _Pattern:
    """A measured surgery: what is stored of it and of each of its stages, in order."""

    surgery: NewSurgery
    calibration: str
    stages: Sequence[NewStage]
    results: Sequence[StageResult]
    spines: Sequence[StageSpine]


def fill(database: Database, surgery_id: str, count: int) -> list[str]:
    """Store a measured surgery again and again, with its stages, results and spines; return the new surgeries.

    All of them have the images of the first. Their jobs have succeeded, so that no worker takes them.
    """
    with database.read() as session:
        pattern = _read(session, surgery_id)
    return [_copy(database, pattern) for _ in range(count)]


def _read(session: Session, surgery_id: str) -> _Pattern:
    surgery = surgeries.get(session, surgery_id)
    names = session.scalars(
        select(Stage.name).where(Stage.surgery_id == surgery_id).order_by(Stage.created_at, Stage.id)
    ).all()
    rows = [measurements.get(session, surgery_id, name) for name in names]
    return _Pattern(
        surgery=NewSurgery(
            reference="2026-0417",
            vertebrae=surgery.vertebrae,
            reference_vertebra=surgery.reference_vertebra,
            spine_axis=cast(Any, surgery.spine_axis),
        ),
        calibration=rows[0][0].calibration_id,
        stages=[
            NewStage(stage.name, _image(session, stage.left), _image(session, stage.right), None)
            for stage, _ in rows
        ],
        results=[
            StageResult.model_validate(
                {
                    **measured.result,
                    "features": measurements.features(session, stage.id),
                    "triads": measurements.triads(session, stage.id),
                    "burst": None,
                }
            )
            for stage, measured in rows
        ],
        spines=[StageSpine.model_validate_json(spines.get(session, surgery_id, name)) for name in names],
    )


def _image(session: Session, row: Image) -> NewImage:
    return NewImage(
        images.content(session, row.sha256), ImageHeader("PNG", row.media_type, row.width, row.height)
    )


def _copy(database: Database, pattern: _Pattern) -> str:
    with database.write() as session:
        surgery = surgeries.add(session, pattern.surgery, utc_now(), _ACTOR)
        calibration = calibrations.get(session, pattern.calibration)
        for new, result in zip(pattern.stages, pattern.results, strict=True):
            now = utc_now()  # stages of a surgery are sorted by time
            stage = stage_submission.submit(session, surgery, calibration, new, now, _ACTOR)
            session.flush()
            measurements.add(session, stage.id, measurements.MeasuredStage(result).packed(), now, _ACTOR)
        spine_setups.put(session, surgery.id, SpineSetup.model_validate(spine_document()), utc_now(), _ACTOR)
        session.flush()
        plans = spines.plans(session, surgery, spine_setups.get(session, surgery.id))
        computed = [
            ComputedSpine(plan, spine, None) for plan, spine in zip(plans, pattern.spines, strict=True)
        ]
        spines.add(session, surgery.id, computed, pattern.spines[0].version, utc_now(), _ACTOR)
        session.flush()
        ended = {"state": JobState.SUCCEEDED, "progress": 1.0, "finished_at": utc_now()}
        session.execute(update(Job).where(Job.state == JobState.QUEUED).values(**ended))
        return surgery.id


def _measured_surgery(service: LoadService, seed: int) -> tuple[str, tuple[float, float]]:
    """Measure a surgery with its spine; return it, and the growth of the database per stage, whole and images."""
    files = make_pairs(STAGES, seed)
    cart = Cart.of(service)
    cart.open_surgery(spine=True)
    before = _size(service)
    for number, pair in enumerate(files):
        cart.ended(cart.submit(f"S{number}", pair))
    end = time.monotonic() + _PATIENCE_S
    path = f"/v1/surgeries/{cart.surgery}/summary"
    while any(stage["spine"] is None for stage in cart.request("GET", path).json()["stages"]):
        if time.monotonic() > end:
            raise ServiceStuckError(f"spines are not computed after {_PATIENCE_S:.0f} s; see {service.log}")
        time.sleep(_POLL_S)
    growth = (_size(service) - before) / STAGES, sum(pair.size_bytes for pair in files) / STAGES
    cart.close()
    return cart.surgery, growth


def _over_http(service: LoadService, chosen: Sequence[str]) -> tuple[list[float], int]:
    """Return the milliseconds of each summary over one connection, and the size of the last one."""
    address = urlsplit(service.url)
    connection = http.client.HTTPConnection(str(address.hostname), address.port, timeout=_PATIENCE_S)
    headers = {"Authorization": f"Bearer {service.key}"}
    size = 0

    def get(surgery_id: str) -> None:
        nonlocal size
        connection.request("GET", f"/v1/surgeries/{surgery_id}/summary", headers=headers)
        answer = connection.getresponse()
        body = answer.read()
        if answer.status != HTTPStatus.OK:
            raise ServiceStuckError(f"summary of {surgery_id}: {answer.status} {body[:500]!r}")
        size = len(body)

    get(chosen[0])
    times = [milliseconds(partial(get, surgery_id)) for surgery_id in chosen]
    connection.close()
    return times, size


def _in_process(database: Database, surgery_id: str) -> None:
    with database.read() as session:
        rows = summaries.get(session, surgery_id)
    summary_json(rows)


def _size(service: LoadService) -> int:
    """Return the size of the database, bytes, with all that is committed in its one file."""
    database = service.database()
    try:
        if database.engine.dialect.name == "postgresql":
            with database.read() as session:
                return int(session.scalar(text("SELECT pg_database_size(current_database())")) or 0)
        database.checkpoint()
        with database.read() as session:
            pages = session.scalar(
                text("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size")
            )
            return int(pages or 0)
    finally:
        database.close()


def _row(ms: Sequence[float]) -> tuple[str, str, str]:
    return f"{median(ms):.1f}", f"{_p99(ms):.1f}", f"{max(ms):.1f}"


def _p99(ms: Sequence[float]) -> float:
    return float(np.percentile(ms, 99))
