"""What the spine of each stage is computed from."""

import pytest

from contract.job import JobState
from contract.stage_reference import StageReference
from store import spine_plans, spine_setups, stage_submission, stages, surgeries
from store.database import Database
from store.spine_plans import StagePlan
from store.stage_submission import NewStage
from tests.store.builders import (
    CLIENT,
    at,
    claimed,
    image,
    new_stage,
    stage_result,
    succeed,
    triad,
    without_pose,
)
from tests.store.builders import end as fail
from tests.store.spines import configured, end, measured


def planned(database: Database, surgery: str) -> tuple[StagePlan, ...]:
    with database.read() as session:
        setup = spine_setups.get(session, surgery)
        return spine_plans.plans(session, surgeries.get(session, surgery), setup)


def test_the_baseline_is_the_first_stage_even_without_the_reference_and_the_stage_before_has_it(
    database: Database,
) -> None:
    surgery = configured(database)
    measured(database, surgery, "A", 1, ["T11"])
    measured(database, surgery, "B", 2)
    measured(database, surgery, "C", 3, ["T11", "T9"])
    measured(database, surgery, "D", 4)
    plans = planned(database, surgery)
    assert [(p.reference.name, p.baseline, p.previous) for p in plans] == [
        ("A", "A", None),
        ("B", "A", None),
        ("C", "A", "B"),
        ("D", "A", "B"),
    ]


def test_a_reference_without_a_pose_is_no_reference(database: Database) -> None:
    surgery = configured(database)
    stage = new_stage(database, surgery, "A", now=at(1))
    result = stage_result([without_pose("L1"), triad("T11")])
    succeed(database, claimed(database, stage.job.id, 1), 1, result)
    measured(database, surgery, "B", 2)
    assert [plan.previous for plan in planned(database, surgery)] == [None, None]


def test_a_named_baseline_and_another_reference(database: Database) -> None:
    surgery = configured(database, baseline="C", reference_vertebra="T11")
    measured(database, surgery, "A", 1, ["L1"])
    measured(database, surgery, "B", 2, ["T11"])
    measured(database, surgery, "C", 3)
    plans = planned(database, surgery)
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
    plans = planned(database, surgery)
    assert [(p.reference.name, p.baseline, p.previous) for p in plans] == [
        ("PRE", "PRE", None),
        ("INTER", "PRE", "PRE"),
        ("POST", "PRE", "INTER"),
    ]


@pytest.mark.parametrize("ended", [JobState.FAILED, JobState.CANCELLED, None])
def test_no_later_stage_takes_the_place_of_a_first_one_without_a_result(
    database: Database, ended: JobState | None
) -> None:
    surgery = configured(database)
    first = new_stage(database, surgery, "PRE", now=at(1))
    if ended is not None:
        fail(database, first.job.id, ended)
    measured(database, surgery, "INTER", 2)
    measured(database, surgery, "POST", 3)
    assert [(p.baseline, p.previous) for p in planned(database, surgery)] == [("PRE", None), ("PRE", "INTER")]


def test_a_revision_that_hides_the_reference_changes_no_baseline(database: Database) -> None:
    surgery = configured(database)
    measured(database, surgery, "PRE", 1)
    measured(database, surgery, "POST", 2)
    before = planned(database, surgery)
    with database.write() as session:
        old = stages.get(session, surgery, "PRE")
        new = NewStage("PRE", image(b"left"), image(b"right"), None)
        retake = stage_submission.submit(
            session, surgeries.get(session, surgery), old.calibration, new, at(3), CLIENT, retake=True
        )
    end(database, retake.job.id, 3, ["T11"])
    after = planned(database, surgery)
    assert [(p.reference.take, p.baseline, p.previous) for p in after] == [(2, "PRE", None), (1, "PRE", None)]
    assert all(a.fingerprint != b.fingerprint for a, b in zip(before, after, strict=True))


def test_the_baseline_depends_neither_on_a_retake_nor_on_the_clock(database: Database) -> None:
    surgery = configured(database)
    fail(database, new_stage(database, surgery, "PRE", now=at(1)).job.id, JobState.FAILED)
    measured(database, surgery, "POST", -600)
    (before,) = planned(database, surgery)
    assert before.baseline == "PRE"
    measured(database, surgery, "PRE", -300)
    plans = planned(database, surgery)
    assert [(p.reference.name, p.baseline, p.previous) for p in plans] == [
        ("PRE", "PRE", None),
        ("POST", "PRE", "PRE"),
    ]
    assert before.fingerprint != plans[1].fingerprint  # so that POST is computed again


def test_the_stages_are_named_with_take_and_calibration(database: Database) -> None:
    surgery = configured(database)
    stage = new_stage(database, surgery, "PRE", now=at(1))
    end(database, stage.job.id, 1)
    (plan,) = planned(database, surgery)
    assert plan.reference == StageReference(name="PRE", take=1, calibration_id=stage.calibration_id)
