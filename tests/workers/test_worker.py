"""A worker on real pictures, one process."""

from datetime import timedelta
from functools import partial

from sqlalchemy import func, select, text

from settings import Settings
from store import jobs, stages
from store.clock import utc_now
from store.database import Database
from store.tables import Job, JobState, Measurement
from tests.store.builders import new_stage, new_surgery, sample_pair
from workers.carry_out import carry_out
from workers.worker import Worker

CARRY_OUT = partial(carry_out, max_calibration_age=timedelta(days=1))


def work_on(record: Database, pair: tuple[bytes, bytes], times: int = 1) -> Job:
    stage = new_stage(record, new_surgery(record), pair=pair, now=utc_now())
    worker = Worker(record, Settings(), CARRY_OUT)
    for _ in range(times):
        worker.answer(stage.job.id)
    assert worker.attempt is None
    with record.reading() as session:
        return jobs.get(session, stage.job.id)


def measurements(record: Database) -> int:
    with record.reading() as session:
        return session.scalar(select(func.count()).select_from(Measurement)) or 0


def test_a_stage_is_measured_once_however_often_the_bell_rings(record: Database) -> None:
    job = work_on(record, sample_pair(), times=3)
    assert (job.state, job.attempts) == (JobState.SUCCEEDED, 1)
    assert measurements(record) == 1
    assert job.stage is not None
    with record.reading() as session:
        _, measured = stages.measurement(session, job.stage.surgery_id, "PRE")
    assert [triad.label for triad in measured.triads] == ["L1", "T11", "T9", "T7"]
    assert measured.parameters["ball_diameter_mm"] == 8.0


def test_a_picture_that_cannot_be_decoded_fails_at_once_by_name(record: Database) -> None:
    left, right = sample_pair()
    job = work_on(record, (left, right[:20_000]))
    assert (job.state, job.attempts) == (JobState.FAILED, 1)
    assert job.error is not None
    assert job.error["code"] == "invalid-image"
    assert measurements(record) == 0


def test_the_same_picture_in_two_files_fails_by_name(record: Database) -> None:
    left, _ = sample_pair()
    job = work_on(record, (left, left + b"\0"))
    assert job.error is not None
    assert job.error["code"] == "same-image-twice"


def test_an_unexpected_error_is_tried_again_until_attempts_run_out(record: Database) -> None:
    stage = new_stage(record, new_surgery(record), pair=sample_pair(), now=utc_now())
    with record.writing() as session:
        session.execute(text("UPDATE surgeries SET vertebrae = '[[]]'"))  # no such labels can be asked for
    worker = Worker(record, Settings(max_attempts=2), CARRY_OUT)
    seen = []
    for _ in range(4):
        worker.answer(stage.job.id)
        with record.reading() as session:
            job = jobs.get(session, stage.job.id)
        seen.append((job.state, job.attempts))
    queued, failed = JobState.QUEUED, JobState.FAILED
    assert seen == [(queued, 1), (queued, 2), (failed, 2), (failed, 2)]
    assert job.error is not None
    assert job.error["code"] == "attempts-exhausted"


def test_a_result_that_cannot_be_written_is_tried_again_at_once(record: Database) -> None:
    stage = new_stage(record, new_surgery(record), pair=sample_pair(), now=utc_now())
    refuse = "CREATE TRIGGER fault BEFORE INSERT ON measurements BEGIN SELECT RAISE(ABORT, 'fault'); END"
    worker = Worker(record, Settings(), CARRY_OUT)
    states = []
    for statement in (refuse, "DROP TRIGGER fault"):
        with record.writing() as session:
            session.execute(text(statement))
        worker.answer(stage.job.id)
        with record.reading() as session:
            states.append(jobs.get(session, stage.job.id).state)
    assert states == [JobState.QUEUED, JobState.SUCCEEDED]
    assert measurements(record) == 1
