"""What a sweep sees and changes."""

from store import job_sweep, jobs, leases
from store.database import Database
from tests.store.builders import (
    CLIENT,
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


def claimable(database: Database) -> list[str]:
    with database.read() as session:
        return [job.id for job in job_sweep.unended(session) if job.claimable]


def test_unended_jobs_say_whether_they_can_be_claimed_and_change_with_each_step(database: Database) -> None:
    surgery = new_surgery(database)
    waiting, running, expired, ended = (
        new_stage(database, surgery, name, now=at(n)).job.id for n, name in enumerate("WREF")
    )
    lease = claimed(database, running, 1)
    claimed(database, expired, 1)
    expire(database, expired)
    succeed(database, claimed(database, ended))
    with database.read() as session:
        seen = job_sweep.unended(session)
    assert [(job.id, job.claimable) for job in seen] == [(waiting, True), (running, False), (expired, True)]
    with database.write() as session:
        assert job_sweep.mark_enqueued(session, seen[0], at(20))
        assert not job_sweep.mark_enqueued(session, seen[0], at(21))
        assert not job_sweep.mark_enqueued(session, seen[1], at(20))
        assert leases.heartbeat(session, lease, at(30), 0.5, None)
        assert not job_sweep.expire(session, seen[1])  # it beat meanwhile
    with database.read() as session:
        assert set(job_sweep.unended(session)) & set(seen) == {seen[2]}


def test_a_job_that_waits_for_another_is_claimed_and_swept_only_after_that_has_ended(
    database: Database,
) -> None:
    surgery = new_surgery(database)
    first, second = (new_stage(database, surgery, name).job.id for name in ("PRE", "POST"))
    lease = claimed(database, second)
    with database.write() as session:
        assert leases.requeue(session, lease, at(1), WORKER, count_attempt=False, waits_for=first)
        assert not jobs.has_ended(session, first)
        assert jobs.waiting_for(session, first) == (second,)
    assert claim(database, second, 2) is None
    assert claimable(database) == [first]
    with database.write() as session:
        jobs.cancel(session, first, at(3), CLIENT)
        assert jobs.has_ended(session, first)
    assert claimable(database) == [second]
    again = claimed(database, second, 4)
    assert again.attempt == 1
    assert show(database, second).waits_for is None
    with database.read() as session:
        assert jobs.waiting_for(session, first) == ()
