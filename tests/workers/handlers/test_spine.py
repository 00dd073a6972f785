"""Jobs that compute spines, in a database."""

from datetime import timedelta

from sqlalchemy import select

from contract.job import JobState
from contract.spine import StageSpine
from settings import Settings
from store import jobs, leases, spine_jobs, spine_setups, spines
from store.database import Database
from store.tables.events import Event
from store.tables.jobs import Job
from store.tables.spines import Spine
from tests.store.builders import (
    CLIENT,
    NOON,
    WORKER,
    at,
    claimed,
    new_stage,
    new_surgery,
    spine_setup,
    stage_result,
    succeed,
    triad,
)
from workers.handlers.spine import handler
from workers.registry import Registry
from workers.worker import Worker

PLACES = {"L1": [0.0, 0.0, 0.0], "T11": [60.0, 2.0, 0.0], "T9": [120.0, 5.0, 0.0]}


def measured(database: Database, surgery: str, name: str, second: float, *labels: str) -> None:
    stage = new_stage(database, surgery, name, now=at(second))
    result = stage_result([triad(label, position_mm=PLACES[label]) for label in labels])
    succeed(database, claimed(database, stage.job.id, second), second, result)


def submitted(database: Database, surgery: str) -> str:
    with database.write() as session:
        job = spine_jobs.submit(session, surgery, NOON)
    assert job is not None
    return job


def work_on(database: Database, job: str) -> tuple[JobState, tuple[str, ...]]:
    settings = Settings()
    added = Worker(database, settings, Registry([handler(settings)]), WORKER).handle(job)
    with database.read() as session:
        return jobs.get(session, job).state, added


def configured(database: Database) -> str:
    surgery = new_surgery(database)
    with database.write() as session:
        spine_setups.put(session, surgery, spine_setup(), NOON, CLIENT)
    return surgery


def test_every_stage_gets_a_spine_or_a_reason_and_is_not_computed_twice(database: Database) -> None:
    surgery = configured(database)
    measured(database, surgery, "PRE", 1, "L1", "T11", "T9")
    measured(database, surgery, "LOST", 2, "T11")
    measured(database, surgery, "POST", 3, "L1", "T11")
    assert work_on(database, submitted(database, surgery)) == (JobState.SUCCEEDED, ())
    with database.read() as session:
        post = StageSpine.model_validate_json(spines.get(session, surgery, "POST"))
        rows = {row.reason for row in session.scalars(select(Spine))}
        count = len(session.scalars(select(Event).where(Event.action == "spine:computed")).all())
    assert post.since_previous is not None
    assert post.since_previous.since.name == "PRE"
    assert {state.vertebra for state in post.vertebrae if state.marked} == {"L1", "T11"}
    (reason,) = rows - {None}
    assert "L1 has no pose in stage LOST" in str(reason)
    assert count == 3
    assert work_on(database, submitted(database, surgery)) == (JobState.SUCCEEDED, ())
    with database.read() as session:
        assert len(session.scalars(select(Spine.id)).all()) == 3


def test_a_stage_that_is_measured_while_the_job_runs_is_computed_by_the_next_one(database: Database) -> None:
    surgery = configured(database)
    late = new_stage(database, surgery, "PRE", now=at(1))
    measured(database, surgery, "POST", 2, "L1", "T11")
    job = submitted(database, surgery)
    with database.write() as session:
        lease = leases.claim(session, job, NOON, timedelta(seconds=60), 3, WORKER)
    assert lease is not None
    made = handler(Settings())
    with database.read() as session:
        work = made.load(session, lease)
    computed = made.run(work, lambda *_: None)
    result = stage_result([triad(label, position_mm=PLACES[label]) for label in ("L1", "T11")])
    succeed(database, claimed(database, late.job.id, 3), 3, result)
    with database.write() as session:
        (follow_up,) = made.store(session, lease, computed, at(4), WORKER)
    assert work_on(database, follow_up) == (JobState.SUCCEEDED, ())
    with database.read() as session:
        post = StageSpine.model_validate_json(spines.get(session, surgery, "POST"))
        assert session.get(Job, follow_up) is not None
    assert post.baseline.name == "PRE"
    assert post.since_baseline is not None


def test_a_surgery_without_a_setup_has_nothing_to_compute(database: Database) -> None:
    surgery = new_surgery(database)
    measured(database, surgery, "PRE", 1, "L1")
    with database.write() as session:
        job = jobs.add(session, "spine", surgery, NOON, {"surgery_id": surgery}).id
    assert work_on(database, job) == (JobState.SUCCEEDED, ())
