import sqlite3
import time
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy.exc import OperationalError

from store import jobs, leases
from store.clock import utc_now
from store.database import Database
from tests.backends import about_the_sqlite_file
from tests.store.builders import CLIENT, LEASE, WORKER, new_stage, new_surgery
from workers.attempt import Attempt, LeaseLostError


@pytest.fixture
def attempt(database: Database) -> Attempt:
    job = new_stage(database, new_surgery(database), now=utc_now()).job.id
    with database.write() as session:
        lease = leases.claim(session, job, utc_now(), LEASE, 3, WORKER)
    assert lease is not None
    return Attempt(database, lease, LEASE)


def test_progress_stores_the_step_and_extends_the_lease(database: Database, attempt: Attempt) -> None:
    before = utc_now()
    time.sleep(0.5)  # the claim was written just before
    attempt.progress("detect left", 0.25)
    with database.read() as session:
        job = jobs.get(session, attempt.lease.job_id)
    assert (job.step, job.progress) == ("detect left", 0.25)
    assert job.lease_until is not None
    assert job.lease_until >= before + LEASE


def test_after_a_cancel_the_next_step_stops_the_work(database: Database, attempt: Attempt) -> None:
    with database.write() as session:
        jobs.cancel(session, attempt.lease.job_id, utc_now(), CLIENT)
    attempt.heartbeat()
    with pytest.raises(LeaseLostError):
        attempt.progress("match", 0.5)


@about_the_sqlite_file
def test_the_work_goes_on_while_another_program_holds_the_database(
    database: Database, attempt: Attempt, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("store.database._BUSY_SECONDS", 0.1)
    impatient = Database(database.url)
    same = Attempt(impatient, attempt.lease, LEASE)
    with closing(sqlite3.connect(tmp_path / "database.sqlite", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        time.sleep(0.5)
        same.progress("detect", 0.25)
        with pytest.raises(OperationalError):
            same.heartbeat()
        other.execute("ROLLBACK")
    same.heartbeat()
    impatient.close()
    with database.read() as session:
        assert jobs.get(session, attempt.lease.job_id).step == "detect"


def test_the_time_of_each_step_is_known(attempt: Attempt) -> None:
    assert attempt.step_seconds() == {}
    for step in ("detect", "match"):
        attempt.progress(step, 0.5)
    seconds = attempt.step_seconds()
    assert set(seconds) == {"detect", "match"}
    assert all(value >= 0 for value in seconds.values())
