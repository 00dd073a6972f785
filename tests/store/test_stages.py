import pytest

from contract.job import JobState
from store import calibrations, stage_submission, stages, surgeries
from store.database import Database
from store.errors import NotFoundError
from store.stage_submission import NewStage
from tests.store.builders import (
    CLIENT,
    NOON,
    RIG,
    at,
    end,
    image,
    measured_take,
    new_stage,
    new_surgery,
)


def test_what_does_not_exist(database: Database) -> None:
    surgery = new_surgery(database)
    with database.read() as session:
        with pytest.raises(NotFoundError, match="stage"):
            stages.get(session, surgery, "PRE")
        with pytest.raises(NotFoundError, match="surgery"):
            stages.get(session, "none", "PRE")


def counting_take(database: Database, surgery: str) -> int:
    with database.read() as session:
        return stages.measured(session, surgery, "PRE").take


def test_the_results_of_the_latest_measured_take_count(database: Database) -> None:
    surgery = new_surgery(database)
    job = new_stage(database, surgery, "OTHER").job.id
    measured_take(database, surgery, b"1", 0)
    assert counting_take(database, surgery) == 1
    with database.write() as session:
        new = NewStage("PRE", image(b"l"), image(b"r"), None)
        calibration = calibrations.add(session, RIG, NOON, CLIENT)
        second = stage_submission.submit(
            session, surgeries.get(session, surgery), calibration, new, at(1), CLIENT, retake=True
        )
    assert counting_take(database, surgery) == 1
    end(database, second.job.id, JobState.FAILED)
    assert counting_take(database, surgery) == 1
    third = measured_take(database, surgery, b"3", 2)
    assert counting_take(database, surgery) == 3
    with database.read() as session:
        assert session.scalars(stages.counting(surgery)).all() == [third.id]
        assert stages.measured(session, surgery, "OTHER").job.id == job
