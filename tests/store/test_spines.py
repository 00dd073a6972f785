"""Spines of stages: when they are computed, and which result is up to date."""

from collections.abc import Sequence

import pytest
from sqlalchemy import select

from contract.job import JobState
from contract.spine_setup import NewRebaseline
from contract.stage_reference import StageReference
from store import leases, spine_setups, spines
from store.database import Database
from store.errors import (
    SetupMissingError,
    SpineNotAvailableError,
    SpineNotReadyError,
    StageNotMeasuredError,
)
from store.spines import ComputedSpine, SpineWork
from store.tables.events import Event
from store.tables.jobs import Job
from store.tables.spines import Spine
from tests.contract.spine_results import stage_spine
from tests.store.builders import (
    CLIENT,
    LEASE,
    NOON,
    WORKER,
    at,
    claimed,
    new_stage,
    new_surgery,
    spine_setup,
    stage_result,
    succeed,
    triad,
    without_pose,
)

VERSION = "0.2.0"


def configured(database: Database, second: float = 0.0, **changes: object) -> str:
    surgery = new_surgery(database)
    configure(database, surgery, second, **changes)
    return surgery


def configure(database: Database, surgery: str, second: float, **changes: object) -> None:
    with database.write() as session:
        spine_setups.put(session, surgery, spine_setup(**changes), at(second), CLIENT)


def measured(
    database: Database, surgery: str, name: str, second: float, labels: Sequence[str] = ("L1", "T11")
) -> str:
    stage = new_stage(database, surgery, name, now=at(second))
    end(database, stage.job.id, second, labels)
    return stage.id


def end(database: Database, job: str, second: float, labels: Sequence[str] = ("L1", "T11")) -> None:
    result = stage_result([triad(label) for label in labels])
    assert succeed(database, claimed(database, job, second), second, result)


def load(database: Database, surgery: str, version: str = VERSION) -> SpineWork:
    with database.read() as session:
        return spines.work(session, surgery, version)


def computed(work: SpineWork, reason: str | None = None) -> list[ComputedSpine]:
    """Return an example of a spine for each stage that is out of date."""
    return [
        ComputedSpine(plan, None if reason else stage_spine(0), reason)
        for plan in work.plans
        if plan.stage_id in work.outdated
    ]


def store(
    database: Database, surgery: str, items: list[ComputedSpine], version: str = VERSION
) -> tuple[str, ...]:
    with database.write() as session:
        return spines.add(session, surgery, items, version, NOON, WORKER)


def submit(database: Database, surgery: str) -> str | None:
    with database.write() as session:
        return spines.submit(session, surgery, NOON)


def test_without_a_setup_there_is_no_job(database: Database) -> None:
    assert submit(database, new_surgery(database)) is None


def test_one_queued_job_is_enough_and_a_running_one_is_not(database: Database) -> None:
    surgery = configured(database)
    first = submit(database, surgery)
    assert first is not None
    assert submit(database, surgery) is None
    with database.write() as session:
        leases.claim(session, first, NOON, LEASE, 3, WORKER)
    second = submit(database, surgery)
    assert second not in {None, first}
    with database.read() as session:
        row = session.get(Job, second)
    assert row is not None
    assert (row.kind, row.subject_id, row.surgery_id, row.state) == (
        "spine", surgery, surgery, JobState.QUEUED,
    )  # fmt: skip


def test_another_surgery_has_its_own_job(database: Database) -> None:
    assert submit(database, configured(database)) is not None
    assert submit(database, configured(database)) is not None


def test_the_baseline_is_the_first_stage_with_the_reference_and_the_stage_before_has_it_too(
    database: Database,
) -> None:
    surgery = configured(database)
    measured(database, surgery, "A", 1, ["T11"])
    measured(database, surgery, "B", 2)
    measured(database, surgery, "C", 3, ["T11", "T9"])
    measured(database, surgery, "D", 4)
    plans = load(database, surgery).plans
    assert [(p.reference.name, p.baseline, p.previous) for p in plans] == [
        ("A", "B", None),
        ("B", "B", None),
        ("C", "B", "B"),
        ("D", "B", "B"),
    ]


def test_a_reference_without_a_pose_is_no_reference(database: Database) -> None:
    surgery = configured(database)
    stage = new_stage(database, surgery, "A", now=at(1))
    result = stage_result([without_pose("L1"), triad("T11")])
    succeed(database, claimed(database, stage.job.id, 1), 1, result)
    measured(database, surgery, "B", 2)
    assert [plan.baseline for plan in load(database, surgery).plans] == ["B", "B"]


def test_a_named_baseline_and_another_reference(database: Database) -> None:
    surgery = configured(database, baseline="C", reference_vertebra="T11")
    measured(database, surgery, "A", 1, ["L1"])
    measured(database, surgery, "B", 2, ["T11"])
    measured(database, surgery, "C", 3)
    plans = load(database, surgery).plans
    assert [(p.baseline, p.previous) for p in plans] == [("C", None), ("C", None), ("C", "B")]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_plans_do_not_depend_on_the_order_in_which_jobs_end(
    database: Database, order: tuple[int, ...]
) -> None:
    surgery = configured(database)
    names = ("PRE", "INTER", "POST")
    stages = [new_stage(database, surgery, name, now=at(n)) for n, name in enumerate(names)]
    for place, number in enumerate(order):
        end(database, stages[number].job.id, 10 + place)
    plans = load(database, surgery).plans
    assert [(p.reference.name, p.baseline, p.previous) for p in plans] == [
        ("PRE", "PRE", None),
        ("INTER", "PRE", "PRE"),
        ("POST", "PRE", "INTER"),
    ]


def test_a_stored_spine_comes_out_as_it_is(database: Database) -> None:
    surgery = configured(database)
    stage = measured(database, surgery, "PRE", 1)
    work = load(database, surgery)
    assert work.outdated == {stage}
    assert list(work.poses) == ["PRE"]
    assert set(work.poses["PRE"]) == {"L1", "T11"}
    assert store(database, surgery, computed(work)) == ()
    with database.read() as session:
        text = spines.get(session, surgery, "PRE")
        actions = session.scalars(select(Event.action).where(Event.subject_id == stage)).all()
    assert type(stage_spine(0)).model_validate_json(text) == stage_spine(0)
    assert actions.count("spine:computed") == 1
    assert not load(database, surgery).outdated
    assert load(database, surgery, "0.3.0").outdated == {stage}


def test_only_stages_whose_inputs_changed_are_computed_again(database: Database) -> None:
    surgery = configured(database)
    measured(database, surgery, "PRE", 1)
    late = new_stage(database, surgery, "INTER", now=at(2))
    post = measured(database, surgery, "POST", 3)
    store(database, surgery, computed(load(database, surgery)))
    end(database, late.job.id, 4)
    assert load(database, surgery).outdated == {late.id, post}  # POST has another stage before it now
    with database.read() as session:
        spines.get(session, surgery, "PRE")
        with pytest.raises(SpineNotReadyError):
            spines.get(session, surgery, "POST")


def test_a_change_of_the_setup_or_a_marker_clamped_again_concerns_every_stage(database: Database) -> None:
    surgery = configured(database)
    ids = {measured(database, surgery, name, n) for n, name in enumerate(("PRE", "POST"))}
    store(database, surgery, computed(load(database, surgery)))
    with database.write() as session:
        new = NewRebaseline(vertebra="T11", before="PRE", after="POST")
        spine_setups.add_rebaseline(session, surgery, new, NOON, CLIENT)
    assert load(database, surgery).outdated == ids
    store(database, surgery, computed(load(database, surgery)))
    configure(database, surgery, 9, baseline="POST")
    assert load(database, surgery).outdated == ids


def test_a_spine_of_former_inputs_is_not_stored_and_is_computed_again(database: Database) -> None:
    surgery = configured(database)
    measured(database, surgery, "PRE", 1)
    former = load(database, surgery)
    configure(database, surgery, 2, baseline="PRE")
    (follow_up,) = store(database, surgery, computed(former))
    with database.read() as session:
        assert session.scalars(select(Spine.id)).all() == []
        job = session.get(Job, follow_up)
        assert job is not None
        assert job.kind == "spine"
        with pytest.raises(SpineNotReadyError, match="queued"):
            spines.get(session, surgery, "PRE")


def test_the_newer_spine_stays_the_last_word(database: Database) -> None:
    surgery = configured(database)
    measured(database, surgery, "PRE", 1)
    former = load(database, surgery)
    configure(database, surgery, 2, baseline="PRE")
    store(database, surgery, computed(load(database, surgery)))
    store(database, surgery, computed(former, "made from the former setup"))
    with database.read() as session:
        spines.get(session, surgery, "PRE")


def test_why_there_is_no_spine(database: Database) -> None:
    surgery = new_surgery(database)
    waiting = new_stage(database, surgery, "LATE", now=at(5))
    measured(database, surgery, "PRE", 1)
    with database.read() as session, pytest.raises(SetupMissingError):
        spines.get(session, surgery, "PRE")
    configure(database, surgery, 2)
    with database.read() as session:
        with pytest.raises(SpineNotReadyError, match="not submitted"):
            spines.get(session, surgery, "PRE")
        with pytest.raises(StageNotMeasuredError, match="queued"):
            spines.get(session, surgery, "LATE")
    store(database, surgery, computed(load(database, surgery), "the reference has no pose"))
    with database.read() as session, pytest.raises(SpineNotAvailableError, match="reference has no pose"):
        spines.get(session, surgery, "PRE")
    assert waiting.take == 1


def test_the_stages_are_named_with_take_and_calibration(database: Database) -> None:
    surgery = configured(database)
    stage = new_stage(database, surgery, "PRE", now=at(1))
    end(database, stage.job.id, 1)
    (plan,) = load(database, surgery).plans
    assert plan.reference == StageReference(name="PRE", take=1, calibration_id=stage.calibration_id)
