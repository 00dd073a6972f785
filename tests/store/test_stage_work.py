from sqlalchemy import text

from contract.job import JobState
from contract.revision import Remeasurement
from store import stage_submission, stage_work
from store.database import Database
from store.measurements import MeasuredStage
from store.tables.stages import Stage
from tests.store.at_rest import without_triggers
from tests.store.builders import (
    CLIENT,
    NOON,
    at,
    claimed,
    end,
    new_stage,
    new_surgery,
    stage_result,
    succeed,
    triad,
    without_pose,
)

ALL = [triad(label) for label in ("L1", "T11", "T9", "T7")]


def test_work_is_images_rig_and_labels(database: Database) -> None:
    stage = new_stage(database, new_surgery(database))
    with database.read() as session:
        work = stage_work.work(session, stage.id)
    assert (work.left, work.right) == (b"left", b"right")
    assert work.rig["name"] == stage.calibration.name
    assert (work.vertebrae, work.spine_axis) == (("L1", "T11", "T9", "T7"), "x")


def test_work_has_the_stages_submitted_before_whatever_became_of_them(database: Database) -> None:
    surgery = new_surgery(database)
    new_stage(database, new_surgery(database), "OTHER", now=at(-9))
    new_stage(database, surgery, "EARLY", (b"l", b"r"), at(-2), captured_at=at(-60))
    end(database, new_stage(database, surgery, "LATE", now=at(-3)).job.id, JobState.FAILED)
    end(database, new_stage(database, surgery, now=at(-1)).job.id, JobState.CANCELLED)
    stage = new_stage(database, surgery, captured_at=at(-5))
    new_stage(database, surgery, "AFTER", now=at(1))
    with database.read() as session:
        work = stage_work.work(session, stage.id, 1)
    assert [earlier.name for earlier in work.earlier] == ["EARLY", "LATE"]
    assert [earlier.captured_at for earlier in work.earlier] == [at(-60), None]
    assert [earlier.is_compared for earlier in work.earlier] == [False, True]
    assert not any(earlier.follows for earlier in work.earlier)
    assert work.earlier[1].sha256 == work.sha256
    assert (work.captured_at, work.calibrated_at) == (at(-5), None)
    assert work.calibration_created_at == NOON


def test_stages_that_are_compared_have_the_strips_that_are_stored(database: Database) -> None:
    surgery = new_surgery(database)
    for name, second, strips in (("A", -4, {"left": b"a"}), ("B", -3, {"right": b"b"}), ("C", -2, {})):
        stage = new_stage(database, surgery, name, now=at(second))
        lease = claimed(database, stage.job.id)
        assert succeed(database, lease, result=MeasuredStage(stage_result(), strips=strips))
    new_stage(database, surgery, "WAITS", now=at(-1))
    last = new_stage(database, surgery)
    with database.read() as session:
        compared, none = (stage_work.work(session, last.id, count).earlier for count in (3, 0))
    assert [dict(earlier.strips) for earlier in compared] == [{}, {"right": b"b"}, {}, {}]
    assert [earlier.is_compared for earlier in compared] == [False, True, True, True]
    assert not any(earlier.strips or earlier.is_compared for earlier in none)


def test_wanted_files_are_added_and_damaged_ones_are_not(database: Database) -> None:
    stage = new_stage(database, new_surgery(database))
    with database.read() as session:
        work = stage_work.work(session, stage.id)
    assert work.files is None
    with without_triggers(database.url, "images") as session:
        session.execute(
            text("UPDATE images SET content = :content WHERE sha256 = :sha256"),
            {"content": b"damaged", "sha256": stage.right_sha256},
        )
    with database.read() as session:
        found = stage_work.with_files(session, work, {stage.left_sha256, stage.right_sha256})
    assert found.files == {stage.left_sha256: b"left"}


def decided(database: Database, stage: Stage) -> tuple[str | None, str | None]:
    """Return the name of the stage that decides on labels, and the job to wait for."""
    with database.read() as session:
        work = stage_work.work(session, stage.id)
    return None if work.labelled is None else work.labelled.name, work.unended_job


def test_the_latest_earlier_stage_with_all_poses_decides_on_labels(database: Database) -> None:
    surgery = new_surgery(database)
    names = ("A", "B", "C", "D")
    made = {name: new_stage(database, surgery, name, now=at(k)) for k, name in enumerate(names)}
    stage = new_stage(database, surgery, "E", now=at(9))
    new_stage(database, surgery, "F", now=at(10))
    assert decided(database, stage) == (None, made["D"].job.id)
    end(database, made["D"].job.id, JobState.CANCELLED)
    assert decided(database, stage) == (None, made["C"].job.id)
    succeed(database, claimed(database, made["B"].job.id), result=stage_result(ALL))
    assert decided(database, stage) == (None, made["C"].job.id)  # C may yet show all
    succeed(
        database, claimed(database, made["C"].job.id), result=stage_result([*ALL[:3], without_pose("T7")])
    )
    assert decided(database, stage) == ("B", None)
    assert decided(database, made["A"]) == (None, None)


def test_a_revision_decides_on_the_labels_of_later_stages_and_repeats_no_image(database: Database) -> None:
    surgery = new_surgery(database)
    first = new_stage(database, surgery)
    succeed(database, claimed(database, first.job.id), result=stage_result(ALL))
    stage = new_stage(database, surgery, "POST", (b"l", b"r"), now=at(9))
    with database.write() as session:
        revised = stage_submission.revise(
            session, surgery, "PRE", Remeasurement(kind="measure", take=1), at(10), CLIENT
        )
    assert decided(database, stage) == (None, revised.job.id)
    succeed(database, claimed(database, revised.job.id), result=stage_result(ALL))
    with database.read() as session:
        work = stage_work.work(session, stage.id)
    assert work.labelled is not None
    assert (work.labelled.name, work.labelled.take) == ("PRE", 2)
    assert [earlier.name for earlier in work.earlier] == ["PRE"]


def test_a_retake_is_compared_with_all_stages_before_it_and_labelled_by_none_that_follows(
    database: Database,
) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery).job.id, JobState.FAILED)
    post = new_stage(database, surgery, "POST", (b"l", b"r"), at(-60))
    succeed(database, claimed(database, post.job.id), result=stage_result(ALL))
    again = new_stage(database, surgery, now=at(-120))
    with database.read() as session:
        work, later = (stage_work.work(session, stage.id) for stage in (again, post))
    assert [(earlier.name, earlier.follows) for earlier in work.earlier] == [("POST", True)]
    assert (work.labelled, work.unended_job) == (None, None)
    assert [(earlier.name, earlier.follows) for earlier in later.earlier] == [("PRE", False)]
    assert decided(database, post) == (None, again.job.id)
