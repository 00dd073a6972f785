"""The migrations: what they make, and the way up and down."""

from pathlib import Path

import pytest
from alembic import command
from sqlalchemy import inspect, text
from sqlalchemy.exc import DBAPIError, IntegrityError

from contract.job import JobState
from contract.revision import Remeasurement
from contract.spine import StageSpine
from migrations.history import config, head, upgrade
from store import jobs, leases, spine_jobs, spine_setups, spines, stage_submission, stages, summaries
from store.database import Database
from store.measurements import MeasuredStage
from store.revision import REVISION, current_revision, require_revision
from store.spines import ComputedSpine
from store.tables.spines import Spine
from tests.contract.spine_results import stage_spine
from tests.migrations.databases import contents, move
from tests.store.builders import (
    CLIENT,
    LEASE,
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
)


def test_the_newest_migration_is_the_one_that_the_store_works_with(empty: Database) -> None:
    upgrade(empty.url)
    assert head() == REVISION == current_revision(empty)
    require_revision(empty)


def test_the_migrations_make_the_tables_of_the_orm(empty: Database) -> None:
    upgrade(empty.url)
    with empty.write() as session:
        command.check(config(session.connection()))


def test_upgrading_twice_changes_nothing(empty: Database) -> None:
    upgrade(empty.url)
    before = inspect(empty.engine).get_table_names()
    upgrade(empty.url)
    assert inspect(empty.engine).get_table_names() == before


def test_the_way_back_leaves_no_table(empty: Database) -> None:
    upgrade(empty.url)
    with empty.write() as session:
        command.downgrade(config(session.connection()), "base")
    assert inspect(empty.engine).get_table_names() == ["alembic_version"]


def test_a_new_database_works(empty: Database) -> None:
    upgrade(empty.url)
    surgery = new_surgery(empty)
    job = new_stage(empty, surgery, now=NOON).job.id
    with empty.write() as session:
        assert leases.claim(session, job, NOON, LEASE, 3, WORKER) is not None
        jobs.cancel(session, job, NOON, CLIENT)
    with empty.read() as session:
        assert stages.get(session, surgery, "PRE").job.state is JobState.CANCELLED


def test_the_way_back_loses_spines_and_their_jobs_and_nothing_else(empty: Database) -> None:
    upgrade(empty.url)
    surgery = new_surgery(empty)
    stage = new_stage(empty, surgery)
    succeed(empty, claimed(empty, stage.job.id))
    with empty.write() as session:
        spine_setups.put(session, surgery, spine_setup(), NOON, CLIENT)
        spine_job = spine_jobs.submit(session, surgery, NOON)
    with empty.read() as session:
        plans = spines.work(session, surgery).plans
    with empty.write() as session:
        spines.add(
            session, surgery, [ComputedSpine(p, stage_spine(0), None) for p in plans], "1", NOON, WORKER
        )
    assert spine_job is not None
    with empty.read() as session:
        assert StageSpine.model_validate_json(spines.get(session, surgery, "PRE")) == stage_spine(0)
        assert summaries.get(session, surgery).stages[0].triads is not None
    move(empty, "0011")
    before = contents(empty)
    move(empty, "0010")
    after = contents(empty)
    assert set(before) - set(after) == {"spine_setups", "spine_rebaselines", "spines"}
    assert {table for table in after if after[table] != before[table]} == {"jobs"}
    assert [row["id"] for row in after["jobs"]] == [stage.job.id]
    upgrade(empty.url)
    with empty.write() as session:
        assert spine_setups.find(session, surgery) is None
        assert spine_setups.put(session, surgery, spine_setup(), NOON, CLIENT)
        assert spine_jobs.submit(session, surgery, NOON) is not None


@pytest.mark.parametrize("revision", ["0018", "0019"])
def test_images_that_move_within_their_rows_stay_as_they_are(empty: Database, revision: str) -> None:
    upgrade(empty.url)
    surgery = new_surgery(empty)
    new_stage(empty, surgery)
    move(empty, "0020")
    before = contents(empty)
    move(empty, "0018")
    move(empty, revision)
    assert contents(empty) == before
    with pytest.raises(DBAPIError, match="the record never changes"), empty.write() as session:
        session.execute(text("UPDATE images SET width = 1"))
    if empty.engine.dialect.name == "sqlite":
        columns = [column["name"] for column in inspect(empty.engine).get_columns("images")]
        assert columns[-1] == ("content" if revision == "0019" else "created_at")
        with empty.read() as session:
            assert session.execute(text("PRAGMA foreign_key_check")).all() == []


def test_the_way_back_loses_strips_and_nothing_else(empty: Database) -> None:
    upgrade(empty.url)
    lease = claimed(empty, new_stage(empty, new_surgery(empty)).job.id)
    succeed(empty, lease, result=MeasuredStage(stage_result(), strips={"left": b"strip"}))
    move(empty, "0020")
    before = contents(empty)
    move(empty, "0019")
    after = contents(empty)
    assert [row.pop("strip") is None for row in before["features"]] == [False, True]
    assert after == before
    upgrade(empty.url)
    assert [row["strip"] for row in contents(empty)["features"]] == [None, None]


def test_stages_that_are_there_get_their_place_by_the_events_and_stay_as_they_are(empty: Database) -> None:
    upgrade(empty.url)
    surgery = new_surgery(empty)
    end(empty, new_stage(empty, surgery, "PRE").job.id, JobState.FAILED)
    new_stage(empty, surgery, "POST", now=at(-600))
    end(empty, new_stage(empty, surgery, "PRE", now=at(-300)).job.id, JobState.SUCCEEDED)
    with empty.write() as session:
        stage_submission.revise(session, surgery, "PRE", Remeasurement(kind="measure", take=2), at(9), CLIENT)
    new_stage(empty, new_surgery(empty))
    before = contents(empty)
    move(empty, "0020")
    assert not {"number", "place"} & set(contents(empty)["stages"][0])
    upgrade(empty.url)
    assert contents(empty) == before
    with pytest.raises(DBAPIError, match="the record never changes"), empty.write() as session:
        session.execute(text("UPDATE stages SET place = 1"))


def test_a_spine_of_no_measurement_is_refused(empty: Database) -> None:
    upgrade(empty.url)
    surgery = new_surgery(empty)
    stage = new_stage(empty, surgery)
    row = Spine(
        surgery_id=surgery, stage_id=stage.id, setup_revision=1, fingerprint="f", document=None, reason="none",
        version="1", created_at=NOON,
    )  # fmt: skip
    with pytest.raises(IntegrityError), empty.write() as session:
        session.add(row)


def test_only_the_owner_can_read_a_database(tmp_path: Path) -> None:
    file = tmp_path / "x.sqlite"
    upgrade(f"sqlite:///{file}")
    database = Database(f"sqlite:///{file}")
    new_surgery(database)
    assert {path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == {0o600}
    database.close()
    file.chmod(0o644)
    upgrade(f"sqlite:///{file}")
    assert file.stat().st_mode & 0o777 == 0o600
