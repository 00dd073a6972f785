import pytest

from store import jobs
from store.clock import utc_now
from store.database import Database
from tests.store.builders import CLIENT, LEASE, WORKER, new_stage, new_surgery
from workers.attempt import Attempt, LeaseLostError


@pytest.fixture
def attempt(database: Database) -> Attempt:
    job = new_stage(database, new_surgery(database), now=utc_now()).job.id
    with database.write() as session:
        lease = jobs.claim(session, job, utc_now(), LEASE, 3, WORKER)
    assert lease is not None
    return Attempt(database, lease, LEASE)


def test_progress_stores_the_step_and_extends_the_lease(database: Database, attempt: Attempt) -> None:
    before = utc_now()
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
