"""Which worker may do a job, and how it ends, at times that the tests choose."""

from typing import Any

import pytest
from sqlalchemy import func, select

from contract.job import JobState
from store import jobs
from store.database import Database
from store.errors import JobFinishedError, NotFoundError
from store.events import Action
from store.jobs import Lease
from store.tables import STAGE_JOB, Event, FeatureList, Job, Measurement, Stage, Triad
from tests.store.builders import (
    CLIENT,
    LEASE,
    NOON,
    WORKER,
    at,
    claim,
    claimed,
    expire,
    new_stage,
    new_surgery,
    succeed,
)


@pytest.fixture
def job(database: Database) -> str:
    return new_stage(database, new_surgery(database)).job.id


def show(database: Database, job: str) -> Job:
    with database.read() as session:
        return jobs.get(session, job)


def results(database: Database) -> tuple[int, ...]:
    with database.read() as session:
        tables = (Measurement, FeatureList, Triad)
        return tuple(session.scalar(select(func.count()).select_from(table)) or 0 for table in tables)


def actions(database: Database) -> list[str]:
    with database.read() as session:
        return list(session.scalars(select(Event.action).order_by(Event.seq)))


def test_a_job_of_any_kind_has_a_subject_and_a_payload(database: Database) -> None:
    payload: dict[str, Any] = {"surgery_id": "s", "format": "csv"}
    with database.write() as session:
        job = jobs.add(session, "export", "the-subject", NOON, payload).id
    lease = claimed(database, job)
    assert (lease.kind, lease.subject_id, lease.payload) == ("export", "the-subject", payload)
    assert lease.surgery_id == "s"
    with database.read() as session:
        (event,) = session.scalars(select(Event)).all()
    assert (event.action, event.subject_id, event.surgery_id) == (Action.JOB_STARTED, job, "s")
    assert (event.actor_kind, event.actor_name) == (WORKER.kind, WORKER.name)


def test_the_job_of_a_stage_names_it(database: Database) -> None:
    stage = new_stage(database, new_surgery(database))
    job = show(database, stage.job.id)
    assert (job.kind, job.subject_id, job.surgery_id) == (STAGE_JOB, stage.id, stage.surgery_id)
    assert job.stage is not None
    assert job.stage.name == "PRE"


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
        assert jobs.heartbeat(session, lease, at(4) + LEASE, 0.5, "match")
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
                return jobs.fail(session, lease, "code", "detail", at(11), WORKER)
            case "requeue":
                return jobs.requeue(session, lease, at(11), WORKER, count_attempt=True)
            case _:
                return jobs.heartbeat(session, lease, at(99), 0.9, "late")


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
            assert jobs.requeue(session, lease, at(10 * attempt), WORKER, count_attempt=True)
    assert claim(database, job, 30) is None
    failed = show(database, job)
    assert failed.state == JobState.FAILED
    assert failed.error is not None
    assert failed.error["code"] == jobs.ATTEMPTS_EXHAUSTED
    assert "3 times" in failed.error["detail"]


def test_an_attempt_of_a_stopped_worker_does_not_count(database: Database, job: str) -> None:
    for second in range(5):
        lease = claimed(database, job, second)
        with database.write() as session:
            assert jobs.requeue(session, lease, at(second), WORKER, count_attempt=False)
    assert show(database, job).attempts == 0
    assert show(database, job).state == JobState.QUEUED


@pytest.mark.parametrize("running", [False, True])
def test_a_cancelled_job_has_ended(database: Database, job: str, running: bool) -> None:
    lease = claimed(database, job, 0) if running else None
    with database.write() as session:
        assert jobs.cancel(session, job, at(1), CLIENT).state == JobState.CANCELLED
    assert claim(database, job, 100) is None
    if lease is not None:
        assert not succeed(database, lease, 2)
        assert results(database) == (0, 0, 0)
    with pytest.raises(JobFinishedError), database.write() as session:
        jobs.cancel(session, job, at(2), CLIENT)


def test_a_job_that_does_not_exist(database: Database) -> None:
    with pytest.raises(NotFoundError), database.write() as session:
        jobs.cancel(session, "none", at(0), CLIENT)
    with pytest.raises(NotFoundError):
        show(database, "none")


def test_events_are_in_order_and_name_their_actors(database: Database, job: str) -> None:
    claimed(database, job, 0)
    expire(database, job)
    succeed(database, claimed(database, job, 10), 11)
    with database.read() as session:
        stage = session.scalars(select(Stage)).one()
        events = session.scalars(select(Event).order_by(Event.seq)).all()
    assert [(event.actor_kind, event.action) for event in events] == [
        ("http", Action.SURGERY_CREATED),
        ("http", Action.CALIBRATION_CREATED),
        ("http", Action.STAGE_SUBMITTED),
        ("worker", Action.JOB_STARTED),
        ("worker", Action.JOB_STARTED),
        ("worker", Action.STAGE_MEASURED),
    ]
    last = events[-1]
    assert (last.subject_id, last.surgery_id, last.at) == (stage.id, stage.surgery_id, at(11))


def claimable(database: Database) -> list[str]:
    with database.read() as session:
        return [job.id for job in jobs.unended(session) if job.claimable]


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
        seen = jobs.unended(session)
    assert [(job.id, job.claimable) for job in seen] == [(waiting, True), (running, False), (expired, True)]
    with database.write() as session:
        assert jobs.mark_enqueued(session, seen[0], at(20))
        assert not jobs.mark_enqueued(session, seen[0], at(21))
        assert not jobs.mark_enqueued(session, seen[1], at(20))
        assert jobs.heartbeat(session, lease, at(30), 0.5, None)
        assert not jobs.expire(session, seen[1])  # it beat meanwhile
    with database.read() as session:
        assert set(jobs.unended(session)) & set(seen) == {seen[2]}


def next_job(database: Database, second: float = 0.0) -> str | None:
    with database.write() as session:
        lease = jobs.claim_next(session, at(second), LEASE, 3, WORKER)
    return None if lease is None else lease.job_id


def test_surgeries_take_turns(database: Database) -> None:
    busy, calm = new_surgery(database), new_surgery(database)
    backlog = [new_stage(database, busy, f"S{n:03}", now=at(n)).job.id for n in range(30)]
    assert [next_job(database) for _ in range(2)] == backlog[:2]
    own = [new_stage(database, calm, name, now=at(100)).job.id for name in ("PRE",)]
    assert next_job(database) == own[0]
    assert next_job(database) == backlog[2]


def test_the_surgery_whose_last_job_was_started_longest_ago_is_next(database: Database) -> None:
    surgeries = [new_surgery(database) for _ in range(3)]
    for number in range(3):
        for surgery in surgeries:
            new_stage(database, surgery, f"S{number}")
    order = []
    for second in (0, -3600, 7200, 0, 1, 2, 3, 4, 5):  # whatever the clock says
        job = next_job(database, second)
        assert job is not None
        order.append(show(database, job).surgery_id)
        with database.write() as session:
            jobs.cancel(session, job, at(second), CLIENT)
    assert next_job(database) is None
    assert [set(order[n : n + 3]) for n in (0, 3, 6)] == [set(surgeries)] * 3
    assert order[:3] == order[3:6] == order[6:]


def test_work_outside_surgeries_has_one_turn(database: Database) -> None:
    with database.write() as session:
        outside = [jobs.add(session, "calibration", f"c{n}", at(n)).id for n in range(5)]
    stage = new_stage(database, new_surgery(database), now=at(60)).job.id
    assert {next_job(database), next_job(database)} == {outside[0], stage}
    assert next_job(database) == outside[1]


def test_a_job_that_has_used_its_attempts_does_not_keep_the_next_one(database: Database) -> None:
    surgery = new_surgery(database)
    bad, good = (new_stage(database, surgery, name, now=at(n)).job.id for n, name in enumerate("AB"))
    for _ in range(3):
        lease = claimed(database, bad)
        with database.write() as session:
            jobs.requeue(session, lease, at(1), WORKER, count_attempt=True)
    assert next_job(database) == good
    assert show(database, bad).state is JobState.FAILED


def test_a_job_whose_workers_always_end_fails_at_last(database: Database, job: str) -> None:
    starts = 0
    while (lease := claim(database, job, starts)) is not None:
        starts += 1
        assert lease.attempt == 1
        expire(database, job)
    failed = show(database, job)
    assert (failed.state, starts) == (JobState.FAILED, 20)
    assert failed.error is not None
    assert failed.error["code"] == jobs.ATTEMPTS_EXHAUSTED


def test_a_job_that_waits_for_another_is_claimed_and_swept_only_after_that_has_ended(
    database: Database,
) -> None:
    surgery = new_surgery(database)
    first, second = (new_stage(database, surgery, name).job.id for name in ("PRE", "POST"))
    lease = claimed(database, second)
    with database.write() as session:
        assert jobs.requeue(session, lease, at(1), WORKER, count_attempt=False, waits_for=first)
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
