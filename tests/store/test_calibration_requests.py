import pytest
from sqlalchemy import select

from store import calibration_requests, calibrations, jobs
from store.database import Database
from store.errors import NotFoundError
from store.events import Action
from store.tables.calibrations import Calibration, CalibrationRequest
from store.tables.events import Event
from store.tables.jobs import CALIBRATION_JOB, Job
from tests.store.builders import CLIENT, NOON, at, claimed, new_request, solved, succeed


def job_of(database: Database, request: str) -> str:
    with database.read() as session:
        return session.scalars(select(Job.id).where(Job.subject_id == request)).one()


def test_a_request_becomes_a_calibration_of_the_same_identifier(database: Database) -> None:
    request = new_request(database)
    with database.read() as session, pytest.raises(NotFoundError):
        calibrations.get(session, request)
    lease = claimed(database, job_of(database, request))
    assert (lease.kind, lease.subject_id, lease.surgery_id) == (CALIBRATION_JOB, request, None)
    assert succeed(database, lease, 1)
    with database.read() as session:
        made = calibrations.get_with_report(session, request)
        happened = session.scalars(select(Event).where(Event.subject_id == request).order_by(Event.seq))
        assert [(event.actor_kind, event.action) for event in happened] == [
            ("http", Action.CALIBRATION_SUBMITTED),
            ("worker", Action.CALIBRATION_SOLVED),
        ]
    assert (made.name, made.calibrated_at, made.created_at) == ("cart 1", NOON, at(1))
    assert made.report is not None
    assert made.report.report == solved().model_dump(mode="json", exclude={"rig", "version"})
    assert [shot.used for shot in made.report.request.shots] == [True, False]


def test_the_request_has_its_job(database: Database) -> None:
    request = new_request(database)
    with database.read() as session:
        row = session.get_one(CalibrationRequest, request)
        (job,) = session.scalars(select(Job)).all()
    assert (job.kind, job.subject_id, job.payload) == (CALIBRATION_JOB, row.id, {})


def test_work_is_the_whole_input_in_order(database: Database) -> None:
    request = new_request(database, shots=3)
    with database.read() as session:
        work = calibration_requests.work(session, request)
    assert work.pairs == [(b"left %d" % n, b"right %d" % n) for n in range(3)]
    assert (work.name, work.control_field, work.verify) == ("cart 1", "pegboard-1995", 1)


def test_after_its_lease_is_lost_a_worker_makes_no_calibration(database: Database) -> None:
    lease = claimed(database, job_of(database, new_request(database)))
    with database.write() as session:
        jobs.cancel(session, lease.job_id, NOON, CLIENT)
    assert not succeed(database, lease, 1)
    with database.read() as session:
        assert session.scalars(select(Calibration)).all() == []
