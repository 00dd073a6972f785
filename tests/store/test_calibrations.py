"""Calibrations from pictures in the record: one transaction at either end, and nothing changes afterwards."""

from datetime import datetime, timedelta

import pytest
from sqlalchemy import select, text
from sqlalchemy.exc import IntegrityError

from store import calibration_requests, calibrations, jobs, stages
from store.database import Database
from store.errors import NotFoundError
from store.events import Action
from store.jobs import Lease
from store.tables import Calibration, Change, Job, JobKind, JobState
from tests.store.builders import NOON, RIG, at, new_request, new_stage, new_surgery, result, solved

LEASE = timedelta(seconds=5)


def claimed(record: Database, request: str) -> Lease:
    with record.writing() as session:
        job = session.scalars(select(Job.id).where(Job.calibration_request_id == request)).one()
        lease = jobs.claim(session, job, NOON, LEASE, 3)
    assert lease is not None
    return lease


def succeed(record: Database, lease: Lease) -> bool:
    with record.writing() as session:
        return jobs.succeed(session, lease, solved(), at(1))


def test_a_request_becomes_a_calibration_of_the_same_identifier(record: Database) -> None:
    request = new_request(record)
    with record.reading() as session, pytest.raises(NotFoundError):
        calibrations.get(session, request)
    lease = claimed(record, request)
    assert (lease.kind, lease.subject_id, lease.surgery_id) == (JobKind.CALIBRATION, request, None)
    assert succeed(record, lease)
    with record.reading() as session:
        made = calibrations.get_with_report(session, request)
        happened = session.scalars(
            select(Change.action).where(Change.subject_id == request).order_by(Change.seq)
        )
        assert list(happened) == [Action.CALIBRATION_SUBMITTED, Action.CALIBRATION_SOLVED]
    assert (made.name, made.calibrated_at, made.created_at) == ("cart 1", NOON, at(1))
    assert made.report is not None
    assert made.report.report == {"shots": [], "flags": []}
    assert [shot.used for shot in made.report.request.shots] == [True, False]


def test_the_time_of_the_shots_is_the_calibration_s(record: Database) -> None:
    request = new_request(record, captured_at=at(-3600))
    assert succeed(record, claimed(record, request))
    with record.reading() as session:
        assert calibrations.get(session, request).calibrated_at == at(-3600)


def test_work_is_everything_that_was_asked_for_in_order(record: Database) -> None:
    request = new_request(record, shots=3)
    with record.reading() as session:
        work = calibration_requests.work(session, request)
    assert work.pairs == [(b"left %d" % n, b"right %d" % n) for n in range(3)]
    assert (work.name, work.control_field, work.verify) == ("cart 1", "pegboard-1995", 1)


def test_who_has_lost_the_lease_makes_no_calibration(record: Database) -> None:
    request = new_request(record)
    lease = claimed(record, request)
    with record.writing() as session:
        jobs.cancel(session, lease.job_id, NOON)
    assert not succeed(record, lease)
    with record.reading() as session:
        assert session.scalars(select(Calibration)).all() == []


def test_a_calibration_that_cannot_be_written_leaves_its_job_running(record: Database) -> None:
    lease = claimed(record, new_request(record))
    with record.writing() as session:
        session.execute(
            text(
                "CREATE TRIGGER fault BEFORE INSERT ON calibration_reports BEGIN SELECT RAISE(ABORT, 'x'); END"
            )
        )
    with pytest.raises(IntegrityError):
        succeed(record, lease)
    with record.writing() as session:
        assert jobs.get(session, lease.job_id).state is JobState.RUNNING
        assert session.scalars(select(Calibration)).all() == []
        session.execute(text("DROP TRIGGER fault"))
    assert succeed(record, lease)


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE calibrations SET rig = '{}'",
        "UPDATE calibrations SET name = 'other'",
        "DELETE FROM calibrations",
        "UPDATE calibration_reports SET report = '{}'",
        "DELETE FROM calibration_reports",
        "UPDATE calibration_shots SET used = 1",
        "DELETE FROM calibration_shots",
        "UPDATE calibration_requests SET name = 'other'",
        "DELETE FROM calibration_requests",
    ],
)
def test_nobody_changes_or_deletes_a_calibration(record: Database, statement: str) -> None:
    assert succeed(record, claimed(record, new_request(record)))
    with pytest.raises(IntegrityError, match="never change"), record.writing() as session:
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
    record: Database, calibrated_at: datetime | None, captured_at: datetime | None, hours: float
) -> None:
    with record.writing() as session:
        calibration = calibrations.add(session, RIG, NOON, calibrated_at)
    stage = new_stage(record, new_surgery(record), calibration=calibration.id, captured_at=captured_at)
    assert calibrations.age(calibration, stage) == timedelta(hours=hours)
    with record.reading() as session:
        assert stages.work(session, stage.id).calibration_age == timedelta(hours=hours)


def test_a_rig_check_is_kept_with_the_measurement(record: Database) -> None:
    surgery = new_surgery(record)
    job = new_stage(record, surgery).job.id
    with record.writing() as session:
        lease = jobs.claim(session, job, NOON, LEASE, 3)
        assert lease is not None
        jobs.succeed(session, lease, {**result(), "rig_check": {"balls": 12}}, NOON)
    with record.reading() as session:
        _, measured = stages.measurement(session, surgery, "PRE")
    assert measured.rig_check == {"balls": 12}
