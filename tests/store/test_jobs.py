"""Who may work on a job, and how it ends, at times that the tests choose."""

from datetime import timedelta

import pytest
from sqlalchemy import func, select

from store import jobs
from store.database import Database
from store.errors import JobFinishedError, NotFoundError
from store.events import Action
from store.jobs import Lease
from store.tables import Change, FeatureList, Job, JobState, Measurement, Stage, Triad
from tests.store.builders import at, new_stage, new_surgery, result

LEASE = timedelta(seconds=5)


@pytest.fixture
def job(record: Database) -> str:
    return new_stage(record, new_surgery(record)).job.id


def claim(record: Database, job: str, second: float, max_attempts: int = 3) -> Lease | None:
    with record.writing() as session:
        return jobs.claim(session, job, at(second), LEASE, max_attempts)


def claimed(record: Database, job: str, second: float) -> Lease:
    lease = claim(record, job, second)
    assert lease is not None
    return lease


def succeed(record: Database, lease: Lease, second: float) -> bool:
    with record.writing() as session:
        return jobs.succeed(session, lease, result(), at(second))


def show(record: Database, job: str) -> Job:
    with record.reading() as session:
        return jobs.get(session, job)


def results(record: Database) -> tuple[int, ...]:
    with record.reading() as session:
        tables = (Measurement, FeatureList, Triad)
        return tuple(session.scalar(select(func.count()).select_from(table)) or 0 for table in tables)


def actions(record: Database) -> list[str]:
    with record.reading() as session:
        return list(session.scalars(select(Change.action).order_by(Change.seq)))


def test_only_one_may_claim_a_job(record: Database, job: str) -> None:
    assert claimed(record, job, 0).attempt == 1
    assert claim(record, job, 1) is None
    assert claim(record, "none", 1) is None


def test_a_lease_that_ran_out_may_be_claimed_by_another(record: Database, job: str) -> None:
    first = claimed(record, job, 0)
    assert claim(record, job, 5) is None
    second = claimed(record, job, 5.1)
    assert second.owner != first.owner
    assert second.attempt == 2


def test_beats_keep_the_lease(record: Database, job: str) -> None:
    lease = claimed(record, job, 0)
    with record.writing() as session:
        assert jobs.extend(session, lease, at(4) + LEASE, 0.5, "match")
    assert claim(record, job, 8) is None
    assert (show(record, job).progress, show(record, job).step) == (0.5, "match")


def test_a_result_is_written_once(record: Database, job: str) -> None:
    lease = claimed(record, job, 0)
    assert succeed(record, lease, 1)
    assert not succeed(record, lease, 2)
    assert results(record) == (1, 2, 2)
    ended = show(record, job)
    assert (ended.state, ended.progress, ended.finished_at) == (JobState.SUCCEEDED, 1.0, at(1))
    assert ended.lease_owner is None
    assert claim(record, job, 100) is None


@pytest.mark.parametrize("end", ["succeed", "fail", "requeue", "extend"])
def test_who_lost_the_lease_changes_nothing(record: Database, job: str, end: str) -> None:
    first = claimed(record, job, 0)
    second = claimed(record, job, 10)
    before = actions(record)
    with record.writing() as session:
        match end:
            case "succeed":
                held = jobs.succeed(session, first, result(), at(11))
            case "fail":
                held = jobs.fail(session, first, "code", "detail", at(11))
            case "requeue":
                held = jobs.requeue(session, first, at(11), count_attempt=True)
            case _:
                held = jobs.extend(session, first, at(99), 0.9, "late")
    assert not held
    assert results(record) == (0, 0, 0)
    assert actions(record) == before
    assert show(record, job).lease_owner == second.owner
    assert show(record, job).step is None
    assert succeed(record, second, 12)


def test_an_expired_lease_that_nobody_took_still_ends_the_job(record: Database, job: str) -> None:
    assert succeed(record, claimed(record, job, 0), 60)


def test_a_job_that_never_ends_fails_after_its_attempts(record: Database, job: str) -> None:
    for attempt in range(3):
        assert claimed(record, job, 10 * attempt).attempt == attempt + 1
    assert claim(record, job, 30) is None
    failed = show(record, job)
    assert failed.state == JobState.FAILED
    assert failed.error is not None
    assert failed.error["code"] == "attempts-exhausted"
    assert "3 times" in failed.error["detail"]


def test_giving_back_in_good_order_is_no_attempt(record: Database, job: str) -> None:
    for second in range(5):
        with record.writing() as session:
            lease = jobs.claim(session, job, at(second), LEASE, 3)
            assert lease is not None
            assert jobs.requeue(session, lease, at(second), count_attempt=False)
    assert show(record, job).attempts == 0
    assert show(record, job).state == JobState.QUEUED


@pytest.mark.parametrize("running", [False, True])
def test_a_cancelled_job_is_over(record: Database, job: str, running: bool) -> None:
    lease = claimed(record, job, 0) if running else None
    with record.writing() as session:
        assert jobs.cancel(session, job, at(1)).state == JobState.CANCELLED
    assert claim(record, job, 100) is None
    if lease is not None:
        assert not succeed(record, lease, 2)
        assert results(record) == (0, 0, 0)
    with pytest.raises(JobFinishedError), record.writing() as session:
        jobs.cancel(session, job, at(2))


def test_a_job_that_does_not_exist(record: Database) -> None:
    with pytest.raises(NotFoundError), record.writing() as session:
        jobs.cancel(session, "none", at(0))
    with pytest.raises(NotFoundError):
        show(record, "none")


def test_the_feed_tells_the_story_in_order(record: Database, job: str) -> None:
    claimed(record, job, 0)
    succeed(record, claimed(record, job, 10), 11)
    assert actions(record) == [
        Action.SURGERY_CREATED,
        Action.CALIBRATION_CREATED,
        Action.STAGE_SUBMITTED,
        Action.JOB_STARTED,
        Action.JOB_STARTED,
        Action.STAGE_MEASURED,
    ]
    with record.reading() as session:
        stage = session.scalars(select(Stage)).one()
        last = session.scalars(select(Change).order_by(Change.seq.desc())).first()
    assert last is not None
    assert (last.subject_id, last.surgery_id, last.at) == (stage.id, stage.surgery_id, at(11))


def test_only_jobs_that_could_be_claimed_and_are_quiet_are_rung(record: Database) -> None:
    surgery = new_surgery(record)
    waiting, running, expired, fresh = (
        new_stage(record, surgery, name, now=at(second)).job.id
        for name, second in (("W", 0), ("R", 0), ("E", 0), ("F", 19))
    )
    claimed(record, expired, 1)
    claimed(record, running, 19)
    quiet = timedelta(seconds=2)
    with record.reading() as session:
        assert set(jobs.unrung(session, at(20), quiet)) == {waiting, expired}
    with record.writing() as session:
        assert jobs.note_ring(session, waiting, at(20), quiet)
        assert not jobs.note_ring(session, waiting, at(20), quiet)
        assert not jobs.note_ring(session, running, at(20), quiet)
    with record.reading() as session:
        assert set(jobs.unrung(session, at(21.5), quiet)) == {expired, fresh}
