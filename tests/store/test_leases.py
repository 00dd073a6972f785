"""Which worker may do a job, and how it ends, at times that the tests choose."""

import pytest
from sqlalchemy import func, select

from contract.job import JobState
from store import leases
from store.database import Database
from store.leases import Lease
from store.tables.events import Event
from store.tables.measurements import FeatureList, Measurement, Triad
from tests.store.builders import (
    LEASE,
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


def results(database: Database) -> tuple[int, ...]:
    with database.read() as session:
        tables = (Measurement, FeatureList, Triad)
        return tuple(session.scalar(select(func.count()).select_from(table)) or 0 for table in tables)


def actions(database: Database) -> list[str]:
    with database.read() as session:
        return list(session.scalars(select(Event.action).order_by(Event.seq)))


def test_only_one_may_claim_a_job(database: Database, job: str) -> None:
    assert claimed(database, job, 0).attempt == 1
    assert claim(database, job, 1) is None
    assert claim(database, "none", 1) is None


@pytest.mark.parametrize("second", [-3600, 3600])
def test_an_expired_lease_may_be_claimed_by_another_whatever_the_clock_says(
    database: Database, job: str, second: float
) -> None:
    first = claimed(database, job, 0)
    assert claim(database, job, second) is None
    expire(database, job)
    again = claimed(database, job, second)
    assert again.owner != first.owner
    assert again.attempt == 1  # the end of a worker is no fault of the job


def test_heartbeats_keep_the_lease(database: Database, job: str) -> None:
    lease = claimed(database, job, 0)
    with database.write() as session:
        assert leases.heartbeat(session, lease, at(4) + LEASE, 0.5, "match")
    assert claim(database, job, 8) is None
    assert (show(database, job).progress, show(database, job).step) == (0.5, "match")


def test_a_result_is_written_once(database: Database, job: str) -> None:
    lease = claimed(database, job, 0)
    assert succeed(database, lease, 1)
    assert not succeed(database, lease, 2)
    assert results(database) == (1, 2, 2)
    ended = show(database, job)
    assert (ended.state, ended.progress, ended.finished_at) == (JobState.SUCCEEDED, 1.0, at(1))
    assert ended.lease_owner is None
    assert claim(database, job, 100) is None


def end_by(database: Database, lease: Lease, end: str) -> bool:
    if end == "succeed":
        return succeed(database, lease, 11)
    with database.write() as session:
        match end:
            case "fail":
                return leases.fail(session, lease, "code", "detail", at(11), WORKER)
            case "requeue":
                return leases.requeue(session, lease, at(11), WORKER, count_attempt=True)
            case _:
                return leases.heartbeat(session, lease, at(99), 0.9, "late")


@pytest.mark.parametrize("end", ["succeed", "fail", "requeue", "heartbeat"])
def test_after_its_lease_is_lost_a_worker_changes_nothing(database: Database, job: str, end: str) -> None:
    first = claimed(database, job, 0)
    expire(database, job)
    second = claimed(database, job, 10)
    before = actions(database)
    assert not end_by(database, first, end)
    assert results(database) == (0, 0, 0)
    assert actions(database) == before
    assert show(database, job).lease_owner == second.owner
    assert show(database, job).step is None
    assert succeed(database, second, 12)


def test_an_expired_lease_that_nobody_claimed_still_ends_the_job(database: Database, job: str) -> None:
    lease = claimed(database, job, 0)
    expire(database, job)
    assert succeed(database, lease, 60)


def test_a_job_that_never_ends_fails_after_its_attempts(database: Database, job: str) -> None:
    for attempt in range(3):
        lease = claimed(database, job, 10 * attempt)
        assert lease.attempt == attempt + 1
        with database.write() as session:
            assert leases.requeue(session, lease, at(10 * attempt), WORKER, count_attempt=True)
    assert claim(database, job, 30) is None
    failed = show(database, job)
    assert failed.state == JobState.FAILED
    assert failed.error is not None
    assert failed.error["code"] == leases.ATTEMPTS_EXHAUSTED
    assert "3 times" in failed.error["detail"]


def test_an_attempt_of_a_stopped_worker_does_not_count(database: Database, job: str) -> None:
    for second in range(5):
        lease = claimed(database, job, second)
        with database.write() as session:
            assert leases.requeue(session, lease, at(second), WORKER, count_attempt=False)
    assert show(database, job).attempts == 0
    assert show(database, job).state == JobState.QUEUED


def test_a_job_whose_workers_always_end_fails_at_last(database: Database, job: str) -> None:
    starts = 0
    while (lease := claim(database, job, starts)) is not None:
        starts += 1
        assert lease.attempt == 1
        expire(database, job)
    failed = show(database, job)
    assert (failed.state, starts) == (JobState.FAILED, 20)
    assert failed.error is not None
    assert failed.error["code"] == leases.ATTEMPTS_EXHAUSTED


def test_a_job_that_has_used_its_attempts_does_not_keep_the_next_one(database: Database) -> None:
    surgery = new_surgery(database)
    bad, good = (new_stage(database, surgery, name, now=at(n)).job.id for n, name in enumerate("AB"))
    for _ in range(3):
        lease = claimed(database, bad)
        with database.write() as session:
            leases.requeue(session, lease, at(1), WORKER, count_attempt=True)
    with database.write() as session:
        following = leases.claim_next(session, at(2), LEASE, 3, WORKER)
    assert following is not None
    assert following.job_id == good
    assert show(database, bad).state is JobState.FAILED
