import pytest
from sqlalchemy import select

from contract.job import JobState
from contract.spine_setup import NewRebaseline, SpineSetup
from store import spine_setups
from store.database import Database
from store.errors import NotFoundError, RebaselineExistsError, SetupMissingError
from store.tables.events import Event
from store.tables.spines import SpineSetup as SpineSetupRow
from tests.store.builders import CLIENT, NOON, at, end, new_stage, new_surgery, spine_setup


def put(database: Database, surgery: str, setup: SpineSetup, second: float = 0.0) -> bool:
    with database.write() as session:
        return spine_setups.put(session, surgery, setup, at(second), CLIENT)


def test_what_is_stored_is_what_comes_out(database: Database) -> None:
    surgery = new_surgery(database)
    assert put(database, surgery, spine_setup())
    with database.read() as session:
        stored = spine_setups.get(session, surgery)
    assert stored.setup == spine_setup()
    assert (stored.surgery_id, stored.revision, stored.created_at) == (surgery, 1, NOON)
    assert stored.rebaselines == []


def test_a_change_is_a_new_revision_and_the_same_setup_is_none(database: Database) -> None:
    surgery = new_surgery(database)
    other = spine_setup(patient_axes={"kind": "directions", "cephalad": "-x", "left": "-y"})
    assert put(database, surgery, spine_setup())
    assert not put(database, surgery, spine_setup(), 1)
    assert put(database, surgery, other, 2)
    assert put(database, surgery, spine_setup(), 3)
    with database.read() as session:
        stored = spine_setups.revisions(session, surgery)
        actions = session.scalars(select(Event.action).order_by(Event.seq)).all()
    assert [item.revision for item in stored] == [1, 2, 3]
    assert [item.setup for item in stored] == [spine_setup(), other, spine_setup()]
    assert [item.actor for item in stored] == [CLIENT.name] * 3
    assert actions.count("spine:configured") == 3


def test_setups_of_earlier_versions_have_the_usual_deviation_of_the_axes(database: Database) -> None:
    surgery = new_surgery(database)
    document = spine_setup().model_dump(mode="json")
    del document["patient_axes"]["direction_sd_deg"]
    with database.write() as session:
        session.add(SpineSetupRow(surgery_id=surgery, revision=1, document=document, created_at=NOON))
    with database.read() as session:
        assert spine_setups.get(session, surgery).setup == spine_setup()
    assert not put(database, surgery, spine_setup(), 1)


def test_a_surgery_without_a_setup(database: Database) -> None:
    surgery = new_surgery(database)
    with database.read() as session:
        assert spine_setups.find(session, surgery) is None
        assert spine_setups.revisions(session, surgery) == []
        with pytest.raises(SetupMissingError, match="PUT one"):
            spine_setups.get(session, surgery)
        for function in (spine_setups.get, spine_setups.revisions, spine_setups.context):
            with pytest.raises(NotFoundError, match="surgery"):
                function(session, "none")


def test_markers_clamped_again_are_kept_in_order(database: Database) -> None:
    surgery = new_surgery(database)
    put(database, surgery, spine_setup())
    for second, (vertebra, before, after) in enumerate([("T9", "PRE", "INTER"), ("T7", "INTER", "POST")], 1):
        with database.write() as session:
            new = NewRebaseline(vertebra=vertebra, before=before, after=after)
            spine_setups.add_rebaseline(session, surgery, new, at(second), CLIENT)
    put(database, surgery, spine_setup(baseline="PRE"), 1.5)
    with database.read() as session:
        latest = spine_setups.get(session, surgery)
        history = spine_setups.revisions(session, surgery)
    assert [(item.vertebra, item.before, item.after) for item in latest.rebaselines] == [
        ("T9", "PRE", "INTER"),
        ("T7", "INTER", "POST"),
    ]
    assert [len(item.rebaselines) for item in history] == [1, 2]


def test_the_same_marker_is_not_clamped_again_twice(database: Database) -> None:
    surgery = new_surgery(database)
    put(database, surgery, spine_setup())
    new = NewRebaseline(vertebra="T9", before="PRE", after="INTER")
    with database.write() as session:
        spine_setups.add_rebaseline(session, surgery, new, NOON, CLIENT)
    with pytest.raises(RebaselineExistsError, match="T9"), database.write() as session:
        spine_setups.add_rebaseline(session, surgery, new, NOON, CLIENT)


def test_the_context_names_each_stage_once_in_their_order(database: Database) -> None:
    surgery = new_surgery(database)
    end(database, new_stage(database, surgery, "PRE", now=at(2)).job.id, JobState.FAILED)
    new_stage(database, surgery, "POST", (b"a", b"b"), now=at(1))
    new_stage(database, surgery, "PRE", now=at(3))
    with database.read() as session:
        context = spine_setups.context(session, surgery)
    assert list(context.stages) == ["PRE", "POST"]
    assert list(context.vertebrae) == ["L1", "T11", "T9", "T7"]
    assert context.reference_vertebra == "L1"
