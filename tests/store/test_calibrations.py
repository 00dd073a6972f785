"""Calibrations in the database: written in one transaction, and never changed afterwards."""

from datetime import datetime, timedelta

import pytest
from sqlalchemy import select, text
from sqlalchemy.exc import IntegrityError

from contract.job import JobState
from store import calibrations, jobs, stage_work
from store.database import Database
from store.errors import NotFoundError, ReportNotFoundError
from store.leases import Lease
from store.page import PageRequest
from store.tables.calibrations import Calibration
from store.tables.jobs import Job
from tests.backends import fault
from tests.store.builders import (
    CLIENT,
    NOON,
    RIG,
    at,
    claimed,
    new_request,
    new_stage,
    new_surgery,
    succeed,
)


def claimed_request(database: Database, captured_at: datetime | None = None) -> Lease:
    request = new_request(database, captured_at=captured_at)
    with database.read() as session:
        job = session.scalars(select(Job.id).where(Job.subject_id == request)).one()
    return claimed(database, job)


def test_the_time_of_the_shots_is_the_calibration_s(database: Database) -> None:
    lease = claimed_request(database, captured_at=at(-3600))
    assert succeed(database, lease)
    with database.read() as session:
        assert calibrations.get(session, lease.subject_id).calibrated_at == at(-3600)


def test_a_given_rig_has_no_report(database: Database) -> None:
    with database.write() as session:
        given = calibrations.add(session, RIG, NOON, CLIENT)
    with database.read() as session:
        row = calibrations.get_with_report(session, given.id)
        with pytest.raises(ReportNotFoundError):
            calibrations.report_of(row)
        with pytest.raises(NotFoundError, match="calibration"):
            calibrations.get(session, "none")
        assert [row.id for row in calibrations.listed(session, PageRequest()).items] == [given.id]


def test_the_quality_in_brief_is_that_of_the_report(database: Database) -> None:
    lease = claimed_request(database)
    assert succeed(database, lease)
    with database.write() as session:
        given = calibrations.add(session, RIG, NOON, CLIENT).id
    with database.read() as session:
        made = calibrations.get_with_report(session, lease.subject_id)
        report = calibrations.report_of(made).report
        briefs = calibrations.briefs(session, [given, lease.subject_id])
        assert calibrations.briefs(session, []) == {}
    left_out = report["leave_one_out"]
    assert set(briefs) == {lease.subject_id}
    brief = briefs[lease.subject_id]
    assert brief.leave_one_out_sd_mm == (None if left_out is None else left_out["sd_mm"])
    assert [flag.model_dump() for flag in brief.flags] == report["flags"]


def test_shots_count_from_one(database: Database) -> None:
    lease = claimed_request(database)
    succeed(database, lease)
    with database.read() as session:
        row = calibrations.get_with_report(session, lease.subject_id)
    assert [calibrations.shot_of(row, number).used for number in (1, 2)] == [True, False]
    with pytest.raises(NotFoundError, match="shot"):
        calibrations.shot_of(row, 3)


def test_a_calibration_that_cannot_be_written_leaves_its_job_running(database: Database) -> None:
    lease = claimed_request(database)
    with fault(database.url, "calibration_reports"), pytest.raises(IntegrityError):
        succeed(database, lease)
    with database.read() as session:
        assert jobs.get(session, lease.job_id).state is JobState.RUNNING
        assert session.scalars(select(Calibration)).all() == []
    assert succeed(database, lease)


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE calibrations SET rig = '{}'",
        "UPDATE calibrations SET name = 'other'",
        "DELETE FROM calibrations",
        "UPDATE calibration_reports SET report = '{}'",
        "DELETE FROM calibration_reports",
        "UPDATE calibration_shots SET used = NOT used",
        "DELETE FROM calibration_shots",
        "UPDATE calibration_requests SET name = 'other'",
        "DELETE FROM calibration_requests",
    ],
)
def test_nobody_changes_or_deletes_a_calibration(database: Database, statement: str) -> None:
    assert succeed(database, claimed_request(database))
    with pytest.raises(IntegrityError, match="never change"), database.write() as session:
        session.execute(text(statement))


@pytest.mark.parametrize(
    ("calibrated_at", "captured_at", "hours"),
    [
        (at(-7200), None, 2.0),
        (at(-7200), at(3600), 3.0),
        (None, at(3600), 1.0),
        (at(-3600), at(-7200), -1.0),
        (at(3600), at(7200), 2.0),
    ],
)
def test_the_age_of_a_calibration_counts_from_what_is_known(
    database: Database, calibrated_at: datetime | None, captured_at: datetime | None, hours: float
) -> None:
    with database.write() as session:
        calibration = calibrations.add(session, RIG, NOON, CLIENT, calibrated_at)
    stage = new_stage(database, new_surgery(database), calibration=calibration.id, captured_at=captured_at)
    assert calibrations.age(calibration, stage) == timedelta(hours=hours)
    with database.read() as session:
        assert stage_work.work(session, stage.id).calibration_age == timedelta(hours=hours)
