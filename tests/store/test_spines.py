"""Spines of stages: when they are computed, and which result is up to date."""

import pytest
from sqlalchemy import select

from contract.spine_setup import NewRebaseline
from store import spine_setups, spines
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
    NOON,
    WORKER,
    at,
    new_stage,
    new_surgery,
)
from tests.store.spines import configure, configured, end, measured

VERSION = "0.2.0"


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


def test_poses_are_in_the_order_of_the_stages_whatever_the_clock_says(database: Database) -> None:
    surgery = configured(database)
    measured(database, surgery, "PRE", 1)
    measured(database, surgery, "POST", -60)
    assert list(load(database, surgery).poses) == ["PRE", "POST"]


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
