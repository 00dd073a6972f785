from datetime import timedelta

import pytest
from sqlalchemy import update

from contract.job import JobState
from store import calibrations, figures
from store.clock import utc_now
from store.database import Database
from store.tables.jobs import Job
from tests.store.builders import (
    CLIENT,
    RIG,
    RIG_CHECK,
    at,
    claimed,
    new_stage,
    new_surgery,
    stage_result,
    succeed,
)


def test_every_state_has_its_number(database: Database) -> None:
    surgery = new_surgery(database)
    names = [new_stage(database, surgery, name).job.id for name in ("A", "B", "C")]
    succeed(database, claimed(database, names[0]))
    claimed(database, names[1])
    with database.read() as session:
        found = figures.jobs_by_state(session)
    assert found == {
        **dict.fromkeys(JobState, 0),
        JobState.SUCCEEDED: 1,
        JobState.RUNNING: 1,
        JobState.QUEUED: 1,
    }


def test_the_queue_is_as_old_as_its_oldest_job(database: Database) -> None:
    with database.read() as session:
        assert figures.queue_seconds(session) == 0
    surgery = new_surgery(database)
    new_stage(database, surgery, "A", now=utc_now() - timedelta(seconds=90))
    new_stage(database, surgery, "B", now=utc_now())
    waits = new_stage(database, surgery, "C", now=utc_now() - timedelta(hours=1)).job.id
    with database.write() as session:
        session.execute(update(Job).where(Job.id == waits).values(waits_for=waits))
    with database.read() as session:
        assert figures.queue_seconds(session) == pytest.approx(90, abs=30)


def test_a_clock_that_was_set_back_makes_no_negative_age(database: Database) -> None:
    new_stage(database, new_surgery(database), now=utc_now() + timedelta(hours=1))
    with database.read() as session:
        assert figures.queue_seconds(session) == 0


def test_the_drift_of_a_calibration_is_that_of_its_last_stage(database: Database) -> None:
    surgery = new_surgery(database)
    with database.write() as session:
        checked, bare = (calibrations.add(session, RIG, at(n), CLIENT).id for n in range(2))
    for n, shift in enumerate(([3.0, 4.0, 0.0], [0.0, 0.0, 2.0])):
        stage = new_stage(database, surgery, f"S{n}", now=at(n), calibration=checked)
        check = {**RIG_CHECK, "shift_mm": shift, "rotation_deg": [0.1, -0.5, 0.2]}
        succeed(database, claimed(database, stage.job.id), n, stage_result(rig_check=check))
    few_balls = new_stage(database, surgery, "S2", now=at(2), calibration=checked)
    succeed(database, claimed(database, few_balls.job.id))
    stage = new_stage(database, surgery, "X", calibration=bare)
    succeed(database, claimed(database, stage.job.id))
    with database.read() as session:
        (drift,) = figures.drifts(session)
    assert (drift.calibration_id, drift.name) == (checked, RIG.name)
    assert (drift.shift_mm, drift.rotation_deg) == (2.0, 0.5)
