from datetime import timedelta

import numpy as np
import pytest
from sqlalchemy import func, select

from store import jobs, stages
from store.database import Database
from store.errors import NotFoundError, StageExistsError, StageNotMeasuredError
from store.tables import Image, JobState
from tests.store.builders import NOON, at, new_stage, new_surgery, result


def end(record: Database, job: str, state: JobState) -> None:
    with record.writing() as session:
        lease = jobs.claim(session, job, NOON, timedelta(seconds=5), 3)
        assert lease is not None
        if state == JobState.SUCCEEDED:
            jobs.succeed(session, lease, result(("L1", None, "T11")), NOON)
        elif state == JobState.FAILED:
            jobs.fail(session, lease, "invalid-image", "The picture is damaged.", NOON)
        elif state == JobState.CANCELLED:
            jobs.cancel(session, job, NOON)


@pytest.mark.parametrize("state", [JobState.FAILED, JobState.CANCELLED])
def test_after_a_stage_came_to_nothing_its_name_is_free(record: Database, state: JobState) -> None:
    surgery = new_surgery(record)
    end(record, new_stage(record, surgery).job.id, state)
    assert new_stage(record, surgery, now=at(1)).take == 2
    with record.reading() as session:
        assert stages.get(session, surgery, "PRE").take == 2
        page = stages.listed(session, surgery, 10, 0)
    assert [(stage.take, stage.job.state) for stage in page.items] == [(1, state), (2, JobState.QUEUED)]


@pytest.mark.parametrize("state", [JobState.QUEUED, JobState.RUNNING, JobState.SUCCEEDED])
def test_a_name_in_use_is_kept(record: Database, state: JobState) -> None:
    surgery = new_surgery(record)
    job = new_stage(record, surgery).job.id
    if state != JobState.QUEUED:
        end(record, job, state)
    with pytest.raises(StageExistsError, match=state.value):
        new_stage(record, surgery)
    assert new_stage(record, new_surgery(record)).take == 1


def test_the_same_picture_is_one_row(record: Database) -> None:
    surgery = new_surgery(record)
    new_stage(record, surgery, "A", (b"1", b"2"))
    new_stage(record, surgery, "B", (b"2", b"3"))
    with record.reading() as session:
        assert session.scalar(select(func.count()).select_from(Image)) == 3


def test_poses_are_those_of_the_labelled_triads(record: Database) -> None:
    surgery = new_surgery(record)
    job = new_stage(record, surgery).job.id
    with pytest.raises(StageNotMeasuredError, match="queued"), record.reading() as session:
        stages.measurement(session, surgery, "PRE")
    end(record, job, JobState.SUCCEEDED)
    with record.reading() as session:
        _, measured = stages.measurement(session, surgery, "PRE")
    assert [triad.label for triad in measured.triads] == ["L1", None, "T11"]
    poses = stages.poses(measured)
    assert list(poses) == ["L1", "T11"]
    assert poses["L1"].position_mm == pytest.approx([1, 2, 3])
    assert poses["L1"].rotation == pytest.approx(np.eye(3))
    assert poses["L1"].covariance.shape == (6, 6)


def test_what_does_not_exist(record: Database) -> None:
    surgery = new_surgery(record)
    with record.reading() as session:
        with pytest.raises(NotFoundError, match="stage"):
            stages.get(session, surgery, "PRE")
        with pytest.raises(NotFoundError, match="surgery"):
            stages.get(session, "none", "PRE")


def test_a_triad_without_a_pose_is_kept_and_moves_nothing(record: Database) -> None:
    surgery = new_surgery(record)
    job = new_stage(record, surgery).job.id
    document = result(("L1", "T11"))
    pose = (
        "position_mm",
        "position_sd_mm",
        "normal",
        "angles_deg",
        "rotation",
        "rotation_sd_deg",
        "covariance",
    )
    document["triads"][1] |= {"reason": "not determined", **dict.fromkeys(pose)}
    with record.writing() as session:
        lease = jobs.claim(session, job, NOON, timedelta(seconds=5), 3)
        assert lease is not None
        jobs.succeed(session, lease, document, NOON)
    with record.reading() as session:
        _, measured = stages.measurement(session, surgery, "PRE")
    assert measured.triads[1].reason == "not determined"
    assert measured.triads[1].x_mm is None
    assert measured.triads[1].covariance is None
    assert list(stages.poses(measured)) == ["L1"]
