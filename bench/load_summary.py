"""The summary of a surgery in a large record, and how much the database grows per stage."""

from __future__ import annotations

import http.client
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from statistics import median
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

import numpy as np
from sqlalchemy import JSON, ColumnElement, Table, Text, insert, select, text, type_coerce
from sqlalchemy.orm import Session

from bench.load_cart import Cart, milliseconds
from bench.load_pairs import make_pairs
from bench.load_service import LoadService, ServiceStuckError
from bench.tables import Bar, Grid
from contract.event import Actor, ActorKind
from contract.job import JobState
from service.routes.summary import summary_json
from store import events, spine_plans, spine_setups, summaries, surgeries, tables
from store.database import Database
from store.json_text import JsonText
from store.tables.base import Base
from store.tables.events import Event
from store.tables.jobs import Job
from store.tables.measurements import Burst, FeatureList, Measurement, PairResult, Triad
from store.tables.spines import Spine
from store.tables.stages import Stage
from store.tables.surgeries import Surgery

SURGERIES = 1000
STAGES = 10
REQUESTS = 1000
_LIMIT_MS = 10.0
_OF_STAGE = (Measurement, FeatureList, Triad, Burst, PairResult)
_AT_ONCE = 20
"""Surgeries that are stored in one transaction."""
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


_Rows = Sequence[Mapping[str, Any]]


@dataclass(frozen=True)
class _Pattern:
    """What is stored of a measured surgery: rows of tables by the names of their columns.

    Attributes
    ----------
    surgery_id
        Its identifier.
    ids
        Identifiers that a copy has of its own: of the surgery, of its stages and of their jobs.
    rows
        Rows by table, in an order in which they can be inserted.
    inputs
        Fingerprints of what the spines are computed from, by stage.
    spines, events
        Spines and events.
    """

    surgery_id: str
    ids: Sequence[str]
    rows: Sequence[tuple[Table, _Rows]]
    inputs: Mapping[str, str]
    spines: _Rows
    events: _Rows


def fill(database: Database, surgery_id: str, count: int) -> list[str]:
    """Store a measured surgery again and again, with all its rows and events; return the new surgeries.

    All of them have the images of the first. Their jobs have succeeded, so that no worker takes them.
    """
    with database.read() as session:
        pattern = _read(session, surgery_id)
    copies: list[str] = []
    while len(copies) < count:
        with database.write() as session:  # workers wait for it
            copies += [_copy(session, pattern) for _ in range(min(_AT_ONCE, count - len(copies)))]
    database.checkpoint()  # as what was stored days ago
    return copies


def _read(session: Session, surgery_id: str) -> _Pattern:
    def rows(table: type[Base], condition: ColumnElement[bool]) -> tuple[Table, _Rows]:
        found = Base.metadata.tables[table.__tablename__]
        return found, _rows(session, found, condition)

    surgery = rows(Surgery, Surgery.id == surgery_id)
    stages = rows(Stage, Stage.surgery_id == surgery_id)
    taken = [row["id"] for row in stages[1]]
    jobs = rows(Job, Job.subject_id.in_([surgery_id, *taken]) & (Job.state == JobState.SUCCEEDED))
    return _Pattern(
        surgery_id=surgery_id,
        ids=[surgery_id, *taken, *(row["id"] for row in jobs[1])],
        rows=[
            surgery,
            stages,
            jobs,
            *(rows(table, table.stage_id.in_(taken)) for table in _OF_STAGE),
            rows(tables.spines.SpineSetup, tables.spines.SpineSetup.surgery_id == surgery_id),
        ],
        inputs=_inputs(session, surgery_id),
        spines=rows(Spine, Spine.surgery_id == surgery_id)[1],
        events=rows(Event, Event.surgery_id == surgery_id)[1],
    )


def _inputs(session: Session, surgery_id: str) -> Mapping[str, str]:
    """Return the fingerprint of what the spine of each stage is computed from."""
    surgery, setup = surgeries.get(session, surgery_id), spine_setups.get(session, surgery_id)
    return {plan.stage_id: plan.fingerprint for plan in spine_plans.plans(session, surgery, setup)}


def _rows(session: Session, table: Table, condition: ColumnElement[bool]) -> _Rows:
    """Return rows of a table in the order in which they were made; documents as the text that is stored."""
    documents = {column.name for column in table.columns if isinstance(column.type, JSON)}
    columns = [type_coerce(c, Text).label(c.name) if c.name in documents else c for c in table.columns]
    query = select(*columns).where(condition).order_by(*table.primary_key.columns)
    return [
        {name: JsonText(v) if name in documents and v is not None else v for name, v in row.items()}
        for row in session.connection().execute(query).mappings()
    ]


def _copy(session: Session, pattern: _Pattern) -> str:
    connection = session.connection()
    new = {old: str(uuid4()) for old in pattern.ids}
    surgery_id = new[pattern.surgery_id]

    def renamed(row: Mapping[str, Any]) -> dict[str, Any]:
        named = {
            name: new.get(value, value) if isinstance(value, str) else value for name, value in row.items()
        }
        if "payload" in row:
            named["payload"] = JsonText(row["payload"].replace(pattern.surgery_id, surgery_id))
        return named

    for table, rows in pattern.rows:
        if rows:
            connection.execute(table.insert(), [renamed(row) for row in rows])
    inputs = _inputs(session, surgery_id)
    new |= {old: inputs[new[stage_id]] for stage_id, old in pattern.inputs.items()}
    computed = [{k: value for k, value in renamed(row).items() if k != "id"} for row in pattern.spines]
    connection.execute(insert(Spine), computed)
    for event in pattern.events:
        actor = Actor(
            kind=ActorKind(event["actor_kind"]),
            name=event["actor_name"],
            key=event["actor_key"],
            address=event["address"],
            request_id=event["request_id"],
        )
        subject = str(new.get(event["subject_id"], event["subject_id"]))
        events.append(
            session, event["at"], actor, event["action"], subject, surgery_id, detail=event["detail"]
        )
    return surgery_id


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
