import pytest

from contract.job import JobState
from store import jobs, stages
from store.database import Database
from store.errors import NotFoundError, StageExistsError
from tests.store.builders import CLIENT, NOON, WORKER, at, claimed, new_stage, new_surgery, succeed


def end(database: Database, job: str, state: JobState) -> None:
    lease = claimed(database, job)
    if state == JobState.SUCCEEDED:
        succeed(database, lease)
        return
    with database.write() as session:
        if state == JobState.FAILED:
            jobs.fail(session, lease, "invalid-image", "The image is damaged.", NOON, WORKER)
        elif state == JobState.CANCELLED:
            jobs.cancel(session, job, NOON, CLIENT)


@pytest.mark.parametrize("state", [JobState.FAILED, JobState.CANCELLED])
def test_the_name_of_a_stage_without_a_result_is_free(database: Database, state: JobState) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery).job.id, state)
    assert new_stage(database, surgery, now=at(1)).take == 2
    with database.read() as session:
        assert stages.get(session, surgery, "PRE").take == 2
        page = stages.listed(session, surgery, 10, 0)
    assert [(stage.take, stage.job.state) for stage in page.items] == [(1, state), (2, JobState.QUEUED)]


@pytest.mark.parametrize("state", [JobState.QUEUED, JobState.RUNNING, JobState.SUCCEEDED])
def test_a_name_in_use_is_refused(database: Database, state: JobState) -> None:
    surgery = new_surgery(database)
    job = new_stage(database, surgery).job.id
    if state != JobState.QUEUED:
        end(database, job, state)
    with pytest.raises(StageExistsError, match=state.value):
        new_stage(database, surgery)
    assert new_stage(database, new_surgery(database)).take == 1


def test_work_is_images_rig_and_labels(database: Database) -> None:
    stage = new_stage(database, new_surgery(database))
    with database.read() as session:
        work = stages.work(session, stage.id)
    assert (work.left, work.right) == (b"left", b"right")
    assert work.rig["name"] == stage.calibration.name
    assert (work.vertebrae, work.spine_axis) == (("L1", "T11", "T9", "T7"), "x")


def test_work_has_the_stages_submitted_before_whatever_became_of_them(database: Database) -> None:
    surgery = new_surgery(database)
    new_stage(database, new_surgery(database), "OTHER", now=at(-9))
    end(database, new_stage(database, surgery, "LATE", now=at(-2)).job.id, JobState.FAILED)
    new_stage(database, surgery, "EARLY", (b"l", b"r"), at(-3), captured_at=at(-60))
    end(database, new_stage(database, surgery, now=at(-1)).job.id, JobState.CANCELLED)
    stage = new_stage(database, surgery, captured_at=at(-5))
    new_stage(database, surgery, "AFTER", now=at(1))
    with database.read() as session:
        work = stages.work(session, stage.id, 1)
    assert [earlier.name for earlier in work.earlier] == ["EARLY", "LATE"]
    assert [earlier.captured_at for earlier in work.earlier] == [at(-60), None]
    assert [dict(earlier.content) for earlier in work.earlier] == [{}, {"left": b"left", "right": b"right"}]
    assert work.earlier[1].sha256 == work.sha256
    assert (work.captured_at, work.calibrated_at) == (at(-5), None)
    assert work.calibration_created_at == NOON


def test_what_does_not_exist(database: Database) -> None:
    surgery = new_surgery(database)
    with database.read() as session:
        with pytest.raises(NotFoundError, match="stage"):
            stages.get(session, surgery, "PRE")
        with pytest.raises(NotFoundError, match="surgery"):
            stages.get(session, "none", "PRE")
