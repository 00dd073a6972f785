"""How a job begins, is found and is cancelled, at times that the tests choose."""

from typing import Any

import pytest
from sqlalchemy import select

from contract.job import JobState
from store import jobs
from store.database import Database
from store.errors import JobFinishedError, NotFoundError
from store.events import Action
from store.tables.events import Event
from store.tables.jobs import STAGE_JOB
from store.tables.measurements import Measurement
from store.tables.stages import Stage
from tests.store.builders import (
    CLIENT,
    NOON,
    WORKER,
    at,
    claim,
    claimed,
    expire,
    new_stage,
    new_surgery,
    show,
    succeed,
)


def test_a_job_of_any_kind_has_a_subject_and_a_payload(database: Database) -> None:
    payload: dict[str, Any] = {"surgery_id": "s", "format": "csv"}
    with database.write() as session:
        job = jobs.add(session, "export", "the-subject", NOON, payload).id
    lease = claimed(database, job)
    assert (lease.kind, lease.subject_id, lease.payload) == ("export", "the-subject", payload)
    assert lease.surgery_id == "s"
    with database.read() as session:
        (event,) = session.scalars(select(Event)).all()
    assert (event.action, event.subject_id, event.surgery_id) == (Action.JOB_STARTED, job, "s")
    assert (event.actor_kind, event.actor_name) == (WORKER.kind, WORKER.name)


def test_the_job_of_a_stage_names_it(database: Database) -> None:
    stage = new_stage(database, new_surgery(database))
    job = show(database, stage.job.id)
    assert (job.kind, job.subject_id, job.surgery_id) == (STAGE_JOB, stage.id, stage.surgery_id)
    assert job.stage is not None
    assert job.stage.name == "PRE"


@pytest.mark.parametrize("running", [False, True])
def test_a_cancelled_job_has_ended(database: Database, job: str, running: bool) -> None:
    lease = claimed(database, job, 0) if running else None
    with database.write() as session:
        assert jobs.cancel(session, job, at(1), CLIENT).state == JobState.CANCELLED
    assert claim(database, job, 100) is None
    if lease is not None:
        assert not succeed(database, lease, 2)
        with database.read() as session:
            assert session.scalars(select(Measurement)).all() == []
    with pytest.raises(JobFinishedError), database.write() as session:
        jobs.cancel(session, job, at(2), CLIENT)


def test_a_job_that_does_not_exist(database: Database) -> None:
    with pytest.raises(NotFoundError), database.write() as session:
        jobs.cancel(session, "none", at(0), CLIENT)
    with pytest.raises(NotFoundError):
        show(database, "none")


def test_events_are_in_order_and_name_their_actors(database: Database, job: str) -> None:
    claimed(database, job, 0)
    expire(database, job)
    succeed(database, claimed(database, job, 10), 11)
    with database.read() as session:
        stage = session.scalars(select(Stage)).one()
        events = session.scalars(select(Event).order_by(Event.seq)).all()
    assert [(event.actor_kind, event.action) for event in events] == [
        ("http", Action.SURGERY_CREATED),
        ("http", Action.CALIBRATION_CREATED),
        ("http", Action.STAGE_SUBMITTED),
        ("worker", Action.JOB_STARTED),
        ("worker", Action.JOB_STARTED),
        ("worker", Action.STAGE_MEASURED),
    ]
    last = events[-1]
    assert (last.subject_id, last.surgery_id, last.at) == (stage.id, stage.surgery_id, at(11))
