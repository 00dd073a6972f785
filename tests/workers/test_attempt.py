from datetime import timedelta

import pytest

from store import jobs
from store.clock import utc_now
from store.database import Database
from tests.store.builders import new_stage, new_surgery
from workers.attempt import Attempt, LeaseLostError

LEASE = timedelta(seconds=5)


@pytest.fixture
def attempt(record: Database) -> Attempt:
    job = new_stage(record, new_surgery(record), now=utc_now()).job.id
    with record.writing() as session:
        lease = jobs.claim(session, job, utc_now(), LEASE, 3)
    assert lease is not None
    return Attempt(record, lease, LEASE)


def test_a_note_tells_the_step_and_keeps_the_lease(record: Database, attempt: Attempt) -> None:
    before = utc_now()
    attempt.note("detect left", 0.25)
    with record.reading() as session:
        job = jobs.get(session, attempt.lease.job_id)
    assert (job.step, job.progress) == ("detect left", 0.25)
    assert job.lease_until is not None
    assert job.lease_until >= before + LEASE


def test_after_a_cancel_the_next_note_stops_the_work(record: Database, attempt: Attempt) -> None:
    with record.writing() as session:
        jobs.cancel(session, attempt.lease.job_id, utc_now())
    attempt.beat()
    with pytest.raises(LeaseLostError):
        attempt.note("match", 0.5)
