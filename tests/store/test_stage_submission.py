from collections.abc import Sequence
from datetime import datetime

import pytest
from sqlalchemy import select
from sqlalchemy.orm import Session

from contract.job import JobState
from contract.revision import LabelEdit, Remeasurement, TriadEdits
from store import calibrations, stage_submission, stage_work, stages, surgeries
from store.database import Database
from store.errors import (
    NotFoundError,
    StageExistsError,
    StageNameSimilarError,
    StageNotMeasuredError,
    TakeSupersededError,
)
from store.measurements import MeasuredStage
from store.page import PageRequest
from store.stage_submission import NewPair, NewStage
from store.tables.events import Event
from store.tables.stages import FurtherPair
from tests.store.builders import (
    CLIENT,
    NOON,
    RIG,
    at,
    claimed,
    end,
    image,
    measured_take,
    new_stage,
    new_surgery,
    stage_result,
    succeed,
    triad,
)
from tests.store.query_plans import read_first


@pytest.mark.parametrize("state", [JobState.FAILED, JobState.CANCELLED])
def test_the_name_of_a_stage_without_a_result_is_free(database: Database, state: JobState) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery).job.id, state)
    assert new_stage(database, surgery, now=at(1)).take == 2
    with database.read() as session:
        assert stages.get(session, surgery, "PRE").take == 2
        page = stages.listed(session, surgery, PageRequest(10, "created_at"))
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


def test_a_new_name_differs_from_others_in_more_than_its_case(database: Database) -> None:
    surgery = new_surgery(database)
    new_stage(database, surgery, "PRE")
    with pytest.raises(StageNameSimilarError, match="a stage PRE, from which Pre differs"):
        new_stage(database, surgery, "Pre")
    assert new_stage(database, surgery, "PRE 2").take == 1
    assert new_stage(database, new_surgery(database), "Pre").take == 1


ALL = [triad(label) for label in ("L1", "T11", "T9", "T7")]


def test_a_stage_keeps_the_place_of_its_first_take_whatever_the_clock_says(database: Database) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery).job.id, JobState.FAILED)
    post = new_stage(database, surgery, "POST", now=at(-600))
    again = new_stage(database, surgery, now=at(-1200))
    end(database, again.job.id, JobState.SUCCEEDED)
    with database.write() as session:
        changes = Remeasurement(kind="measure", take=2)
        revision = stage_submission.revise(session, surgery, "PRE", changes, at(-1800), CLIENT)
    rows = [(stage.number, stage.place, stage.take) for stage in (post, again, revision)]
    assert rows == [(2, 2, 1), (3, 1, 2), (3, 1, 3)]
    assert new_stage(database, new_surgery(database)).number == 1


def test_a_burst_is_stored_in_order(database: Database) -> None:
    surgery = new_surgery(database)
    further = [NewPair(image(b"l%d" % k), image(b"r%d" % k), at(k), at(k)) for k in (2, 1)]
    with database.write() as session:
        stage = stage_submission.submit(
            session,
            surgeries.get(session, surgery),
            calibrations.add(session, RIG, NOON, CLIENT),
            NewStage("PRE", image(b"l"), image(b"r"), None, at(0), at(0.5), further),
            NOON,
            CLIENT,
        )
    with database.read() as session:
        work = stage_work.work(session, stage.id)
        shown = stages.get(session, surgery, "PRE")
        stored = select(FurtherPair).where(FurtherPair.stage_id == shown.id).order_by(FurtherPair.position)
        times = [pair.left_exposed_at for pair in session.scalars(stored)]
    assert [(pair.left, pair.right) for pair in work.pairs] == [(b"l", b"r"), (b"l2", b"r2"), (b"l1", b"r1")]
    assert work.pairs[0].right_exposed_at == at(0.5)
    assert work.captured_at == at(0)
    assert times == [at(2), at(1)]
    assert stage.pair_count == shown.pair_count == 3


def test_a_measured_stage_is_taken_again_on_request_only(database: Database) -> None:
    surgery = new_surgery(database)
    first = measured_take(database, surgery, b"1", 0)
    with pytest.raises(StageExistsError) as refused:
        new_stage(database, surgery)
    assert refused.value.job_id == first.job.id
    assert measured_take(database, surgery, b"2", 1, retake=True).take == 2
    with database.read() as session:
        assert [take.take for take in stages.takes(session, surgery, "PRE")] == [2, 1]
        assert stages.get(session, surgery, "PRE", 1).id == first.id
        with pytest.raises(NotFoundError, match="take"):
            stages.get(session, surgery, "PRE", 3)


def test_the_look_for_a_stage_of_the_name_begins_with_the_stage(database: Database) -> None:
    surgery = new_surgery(database)
    taken = new_stage(database, surgery)

    def look(session: Session) -> None:
        calibration = calibrations.get(session, taken.calibration_id)
        new = NewStage("PRE", image(b"l"), image(b"r"), None)
        stage_submission.find_same(session, surgeries.get(session, surgery), calibration, new)

    steps = read_first(database, look)
    assert [step for step in steps if not step.startswith("SEARCH") or step.split()[1] == "jobs"] == []


def test_the_same_pair_is_known_by_its_images_and_its_calibration(database: Database) -> None:
    surgery = new_surgery(database)
    stage = new_stage(database, surgery)

    def same(left: bytes, right: bytes, calibration: str | None = None) -> str | None:
        with database.read() as session:
            row = calibrations.get(session, calibration or stage.calibration_id)
            new = NewStage("PRE", image(left), image(right), None)
            found = stage_submission.find_same(session, surgeries.get(session, surgery), row, new)
            return None if found is None else found.id

    with database.write() as session:
        other = calibrations.add(session, RIG, NOON, CLIENT).id
    assert same(b"left", b"right") == stage.id
    assert same(b"left", b"other") is same(b"right", b"left") is same(b"left", b"right", other) is None
    end(database, stage.job.id, JobState.CANCELLED)
    assert same(b"left", b"right") is None


def test_the_same_pair_at_another_time_is_another_one(database: Database) -> None:
    surgery = new_surgery(database)

    def sent(
        captured: datetime | None = None,
        left: datetime | None = None,
        right: datetime | None = None,
        further: Sequence[NewPair] = (),
    ) -> NewStage:
        return NewStage("PRE", image(b"l"), image(b"r"), captured, left, right, further)

    def burst(*times: datetime | None) -> Sequence[NewPair]:
        return [NewPair(image(b"l2"), image(b"r2"), *times)]

    with database.write() as session:
        calibration = calibrations.add(session, RIG, NOON, CLIENT)
        row = surgeries.get(session, surgery)
        stored = sent(at(0), at(1), further=burst(at(3), at(4)))
        stage = stage_submission.submit(session, row, calibration, stored, NOON, CLIENT)

    def is_known(new: NewStage) -> bool:
        with database.read() as session:
            row = surgeries.get(session, surgery)
            found = stage_submission.find_same(
                session, row, calibrations.get(session, stage.calibration_id), new
            )
            return found is not None

    assert is_known(stored)
    assert is_known(sent(further=burst()))
    for other in (
        sent(at(9), further=burst()),
        sent(left=at(9), further=burst()),
        sent(right=at(9), further=burst()),
        sent(further=burst(at(9))),
        sent(further=burst(None, at(9))),
        sent(),
    ):
        assert not is_known(other)


def test_a_revision_has_the_images_and_the_time_of_its_take(database: Database) -> None:
    surgery = new_surgery(database)
    first = measured_take(database, surgery, b"1", 0)
    changes = TriadEdits(kind="edit", take=1, labels=[LabelEdit(triad=0, label="T9")])
    with database.write() as session:
        revised = stage_submission.revise(session, surgery, "PRE", changes, at(5), CLIENT)
    assert (revised.take, revised.revised_take, revised.revised_by) == (2, 1, CLIENT.name)
    assert revised.created_at == first.created_at
    with database.read() as session:
        work = stage_work.work(session, revised.id)
        shown = stages.get(session, surgery, "PRE", 2)
        actions = session.scalars(select(Event.action).where(Event.subject_id == revised.id)).all()
    assert (work.left, work.right) == (b"1l", b"1r")
    assert work.revision is not None
    assert work.revision.changes == changes
    assert work.revision.revised == MeasuredStage(stage_result())
    assert (shown.left_sha256, shown.calibration_id) == (first.left_sha256, first.calibration_id)
    assert actions == ["stage:revised"]
    with pytest.raises(StageExistsError), database.write() as session:
        stage_submission.revise(session, surgery, "PRE", changes, at(6), CLIENT)
    assert succeed(database, claimed(database, revised.job.id))
    with pytest.raises(TakeSupersededError, match="take 2"), database.write() as session:
        stage_submission.revise(session, surgery, "PRE", changes, at(7), CLIENT)


def test_only_a_measured_stage_is_revised(database: Database) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery).job.id, JobState.FAILED)
    with pytest.raises(StageNotMeasuredError), database.write() as session:
        stage_submission.revise(session, surgery, "PRE", Remeasurement(kind="measure", take=1), NOON, CLIENT)


def counting_take(database: Database, surgery: str) -> int:
    with database.read() as session:
        return stages.measured(session, surgery, "PRE").take
