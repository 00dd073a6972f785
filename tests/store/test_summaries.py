import json

import pytest
from sqlalchemy import event

from contract.job import JobState
from contract.spine import StageSpine
from store import jobs, spine_setups, spines, summaries
from store.database import Database
from store.errors import NotFoundError
from store.spines import ComputedSpine
from tests.contract.spine_results import stage_spine
from tests.store.builders import (
    CLIENT,
    NOON,
    WORKER,
    at,
    claimed,
    end,
    new_stage,
    new_surgery,
    spine_setup,
    stage_result,
    succeed,
    triad,
)
from tests.store.query_plans import read_first


def with_stages(database: Database, *names: str) -> str:
    """A surgery with a setup and the spines of measured stages."""
    surgery = new_surgery(database)
    with database.write() as session:
        spine_setups.put(session, surgery, spine_setup(), NOON, CLIENT)
    for second, name in enumerate(names):
        stage = new_stage(database, surgery, name, now=at(second))
        result = stage_result([triad("L1"), triad("T11")])
        succeed(database, claimed(database, stage.job.id, second), second, result)
    with database.read() as session:
        plans = spines.work(session, surgery).plans
    with database.write() as session:
        spines.add(
            session, surgery, [ComputedSpine(p, stage_spine(0), None) for p in plans], "1", NOON, WORKER
        )
    return surgery


def test_stages_come_with_triads_and_spine_as_they_are_stored(database: Database) -> None:
    surgery = with_stages(database, "PRE", "POST")
    waiting = new_stage(database, surgery, "LATE", now=at(9))
    with database.read() as session:
        found = summaries.get(session, surgery)
    assert found.surgery.id == surgery
    assert found.setup is not None
    assert [row.stage.name for row in found.stages] == ["PRE", "POST", "LATE"]
    for row in found.stages[:2]:
        assert row.triads is not None
        assert [json.loads(text) for text in row.triads] == [triad("L1"), triad("T11")]
        assert row.spine is not None
        assert StageSpine.model_validate_json(str(row.spine.json)) == stage_spine(0)
    last = found.stages[2]
    assert (last.stage.id, last.triads, last.spine) == (waiting.id, None, None)


def test_only_the_latest_take_counts(database: Database) -> None:
    surgery = new_surgery(database)
    first = new_stage(database, surgery, "PRE")
    with database.write() as session:
        jobs.cancel(session, first.job.id, NOON, CLIENT)
    second = new_stage(database, surgery, "PRE", now=at(1))
    with database.read() as session:
        found = summaries.get(session, surgery)
    assert [row.stage.id for row in found.stages] == [second.id]
    assert found.setup is None


def test_stages_keep_their_order_when_one_is_taken_again_or_the_clock_goes_back(database: Database) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery).job.id, JobState.FAILED)
    new_stage(database, surgery, "POST", now=at(-60))
    new_stage(database, surgery, now=at(60))
    with database.read() as session:
        found = summaries.get(session, surgery)
    assert [(row.stage.name, row.stage.take) for row in found.stages] == [("PRE", 2), ("POST", 1)]


def test_the_number_of_queries_does_not_depend_on_the_number_of_stages(database: Database) -> None:
    counts = []
    for names in (["A"], ["A", "B", "C", "D"]):
        surgery = with_stages(database, *names)
        statements: list[str] = []
        listener = lambda *arguments, kept=statements: kept.append(arguments[2])  # noqa: E731
        event.listen(database.engine, "before_cursor_execute", listener)
        with database.read() as session:
            summaries.get(session, surgery)
        event.remove(database.engine, "before_cursor_execute", listener)
        counts.append(len([statement for statement in statements if statement.startswith("SELECT")]))
    assert counts[0] == counts[1] <= 8


def test_no_query_begins_with_more_than_the_surgery(database: Database) -> None:
    surgery = with_stages(database, "A", "B")
    steps = read_first(database, lambda session: summaries.get(session, surgery))
    assert [step for step in steps if not step.startswith("SEARCH")] == []
    assert [step for step in steps if step.split()[1] in {"jobs", "images_1", "measurements"}] == []


def test_a_surgery_that_there_is_not(database: Database) -> None:
    with database.read() as session, pytest.raises(NotFoundError, match="surgery"):
        summaries.get(session, "none")
