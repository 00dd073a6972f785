import pytest

from contract.job import JobState
from contract.surgery import NewSurgery
from store import surgeries
from store.database import Database
from store.errors import NotFoundError
from store.page import PageRequest
from tests.store.builders import CLIENT, NOON, at, end, new_stage, new_surgery


def test_a_surgery_comes_with_its_stages_and_their_jobs(database: Database) -> None:
    surgery = new_surgery(database)
    new_stage(database, surgery)
    with database.read() as session:
        row = surgeries.get_with_stages(session, surgery)
        listed = surgeries.listed(session, PageRequest(10, "created_at"))
    assert (row.reference, row.vertebrae, row.spine_axis) == ("2026-0417", ["L1", "T11", "T9", "T7"], "x")
    assert row.extra_levels == []
    assert [(stage.name, stage.job.state) for stage in row.stages] == [("PRE", JobState.QUEUED)]
    assert (listed.total, listed.items[0].id) == (1, surgery)


def test_stages_keep_their_order_when_one_is_taken_again_or_the_clock_goes_back(database: Database) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery).job.id, JobState.FAILED)
    new_stage(database, surgery, "POST", now=at(-60))
    new_stage(database, surgery, now=at(60))
    with database.read() as session:
        row = surgeries.get_with_stages(session, surgery)
    assert [(stage.name, stage.take) for stage in row.stages] == [("PRE", 1), ("PRE", 2), ("POST", 1)]


def test_an_unknown_surgery(database: Database) -> None:
    with database.read() as session:
        for get in (surgeries.get, surgeries.get_with_stages):
            with pytest.raises(NotFoundError, match="surgery"):
                get(session, "none")


def test_extra_levels_are_kept(database: Database) -> None:
    new = NewSurgery(
        reference="1", vertebrae=["L1", "T13"], reference_vertebra="L1", extra_levels=["T13", "L6"]
    )
    with database.write() as session:
        surgery = surgeries.add(session, new, NOON, CLIENT).id
    with database.read() as session:
        assert surgeries.get(session, surgery).extra_levels == ["T13", "L6"]
