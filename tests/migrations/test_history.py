"""The migrations on SQLite, and on PostgreSQL where a server runs, with and without data."""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
import pytest
from alembic import command
from sqlalchemy import JSON, MetaData, create_engine, inspect, make_url, select, text
from sqlalchemy.exc import IntegrityError, OperationalError

from contract.calibration import RemovedPoint
from contract.job import JobState
from contract.spine import StageSpine
from migrations.history import config, head, upgrade
from spinewatch.triads.pose import Pose
from store import (
    calibration_checks,
    calibrations,
    jobs,
    measurements,
    spine_setups,
    spines,
    stages,
    summaries,
)
from store.audit import verify_chain
from store.database import Database, sqlite_path
from store.errors import DatabaseNotReadyError
from store.revision import REVISION, current_revision, require_revision
from store.spines import ComputedSpine
from store.tables import CALIBRATION_JOB, STAGE_JOB, Event, Spine
from tests.contract.spine_results import stage_spine
from tests.store.builders import (
    CLIENT,
    LEASE,
    NOON,
    WORKER,
    claimed,
    new_request,
    new_stage,
    new_surgery,
    spine_setup,
    succeed,
)

POSTGRESQL = os.environ.get("TEST_POSTGRESQL_URL", "postgresql+psycopg://root@127.0.0.1:5432/test")


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """The URL of a new database without tables."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'x.sqlite'}"
        return
    pytest.importorskip("psycopg", reason="the package psycopg is not installed")
    server = create_engine(POSTGRESQL, isolation_level="AUTOCOMMIT", connect_args={"connect_timeout": 2})
    name = f"spinewatch_test_{uuid4().hex[:12]}"
    try:
        with server.connect() as connection:
            connection.execute(text(f"CREATE DATABASE {name}"))
    except OperationalError:
        pytest.skip(f"no PostgreSQL server at {POSTGRESQL}")
    yield make_url(POSTGRESQL).set(database=name).render_as_string(hide_password=False)
    with server.connect() as connection:
        connection.execute(text(f"DROP DATABASE {name} WITH (FORCE)"))
    server.dispose()


@pytest.fixture
def empty(url: str) -> Iterator[Database]:
    database = Database(url)
    yield database
    database.close()


def move(database: Database, revision: str) -> None:
    with database.write() as session:
        at = config(session.connection())
        down = (current_revision(database) or "") > revision
        (command.downgrade if down else command.upgrade)(at, revision)


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


def test_a_database_of_another_version_is_left_alone(database: Database) -> None:
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = 'future'"))
    with pytest.raises(DatabaseNotReadyError, match="another version"):
        upgrade(database.url)


def test_a_new_database_works(empty: Database) -> None:
    upgrade(empty.url)
    surgery = new_surgery(empty)
    job = new_stage(empty, surgery, now=NOON).job.id
    with empty.write() as session:
        assert jobs.claim(session, job, NOON, LEASE, 3, WORKER) is not None
        jobs.cancel(session, job, NOON, CLIENT)
    with empty.read() as session:
        assert stages.get(session, surgery, "PRE").job.state is JobState.CANCELLED


LATER = {
    "api_keys",
    "api_sessions",
    "bursts",
    "pair_results",
    "further_pairs",
    "radiographs",
    "spine_setups",
    "spine_rebaselines",
    "spines",
    "processes",
    "step_times",
    "tombstones",
    "purges",
    "purged_images",
    "sent_images",
    "idempotency_keys",
}
"""Tables that version 0.1.0 has nothing for."""

TIME = datetime(2026, 11, 21, 12, tzinfo=UTC)
RANDOM = np.random.default_rng(1)
COVARIANCE = RANDOM.random((6, 6)).tolist()
ROTATION = RANDOM.random((3, 3)).tolist()
X, Y, Z = 0.1 + 0.2, 1e-17 / 3, -1234.567890123456789
POSE = {
    "x_mm": X,
    "y_mm": Y,
    "z_mm": Z,
    "x_sd_mm": 0.1,
    "y_sd_mm": 0.2,
    "z_sd_mm": 0.3,
    "alpha_deg": 89.0,
    "beta_deg": 91.0,
    "gamma_deg": 1.4,
    "normal": [0.0, 0.0, 1.0],
    "rotation": ROTATION,
    "rotation_sd_deg": [1.0, 2.0, 3.0],
    "covariance": COVARIANCE,
}
BALL = {
    "position_mm": [1.0, 2.0, 3.0],
    "sd_mm": [0.1, 0.1, 0.1],
    "left": [5.0, 6.0],
    "right": None,
    "parallax_mm": None,
}
RIG_CHECK = {
    "balls": 12,
    "rms_px": 0.2,
    "chance": 0.3,
    "drifted": False,
    "turn_deg": [0.0, 0.1, 0.2],
    "turn_sd_deg": [0.3, 0.4, 0.5],
    "shift_mm": [0.0, 0.0, 0.0],
    "shift_sd_mm": [1.0, 1.0, 1.0],
}
REMOVED = {"side": "left", "shot": "1", "id": "A1", "miss_px": 2.5}
WORK = {
    "progress": 1.0,
    "step": None,
    "error": None,
    "attempts": 2,
    "lease_owner": None,
    "lease_until": None,
    "rung_at": TIME,
    "created_at": TIME,
    "started_at": TIME,
    "finished_at": TIME,
}
OLD: list[tuple[str, dict[str, Any]]] = [
    ("images", {"sha256": "a", "content": b"1", "media_type": "image/png", "width": 1, "height": 1}),
    ("calibrations", {"id": "r", "name": "cart", "rig": {"name": "cart"}, "calibrated_at": TIME}),
    ("calibration_requests", {"id": "r", "name": "cart", "control_field": "pegboard-1995", "options": {}}),
    ("calibration_shots", {"request_id": "r", "position": 0, "used": True}),
    ("calibration_reports", {"calibration_id": "r", "report": {"removed": [REMOVED]}, "version": "0.1.0"}),
    (
        "surgeries",
        {
            "id": "s",
            "reference": "case",
            "vertebrae": ["L1", "T11"],
            "reference_vertebra": "L1",
            "spine_axis": "x",
        },
    ),
    ("stages", {"id": "t", "surgery_id": "s", "name": "PRE", "take": 1, "calibration_id": "r"}),
    ("stages", {"id": "u", "surgery_id": "s", "name": "POST", "take": 1, "calibration_id": "r"}),
    ("jobs", {"id": "j", "stage_id": "t", "state": "succeeded", **WORK}),
    ("jobs", {"id": "k", "calibration_request_id": "r", "state": "succeeded", **WORK}),
    (
        "jobs",
        {
            "id": "l",
            "stage_id": "u",
            "state": "failed",
            **WORK,
            "error": {"code": "x", "detail": "y"},
        },
    ),
    (
        "measurements",
        {
            "stage_id": "t",
            "flags": [{"code": "calibration-old", "detail": "old"}],
            "fields": {"left": [0, 0, 1, 1], "right": [0, 0, 1, 1]},
            "exposure": {"left": "normal", "right": "dark"},
            "parameters": {"ball_diameter_mm": 8.0},
            "version": "0.1.0",
            "rig_check": RIG_CHECK,
        },
    ),
    (
        "features",
        {
            "stage_id": "t",
            "side": "left",
            "count": 1,
            "points": [{"x": 1.5, "y": 2.5, "score": 0.9, "sd_px": [0.1, 0.1]}],
        },
    ),
    ("features", {"stage_id": "t", "side": "right", "count": 0, "points": []}),
    (
        "triads",
        {
            "stage_id": "t",
            "position": 0,
            "label": "L1",
            "model": "flat-10-14-18",
            "error_mm": 0.25,
            "balls": {"XX": BALL},
            **POSE,
        },
    ),
    (
        "triads",
        {
            "stage_id": "t",
            "position": 1,
            "label": None,
            "label_reason": "the gaps do not decide",
            "model": "flat-10-14-18",
            "reason": "not determined",
            "error_mm": 0.5,
            "balls": {},
        },
    ),
    ("changes", {"seq": 1, "action": "http:surgery:created", "subject_id": "s", "surgery_id": "s"}),
    ("changes", {"seq": 4, "action": "worker:stage:measured", "subject_id": "t", "surgery_id": "s"}),
    ("changes", {"seq": 5, "action": "http:calibration:submitted", "subject_id": "r", "surgery_id": None}),
]
FILLED = {"created_at": TIME, "at": TIME, "left_sha256": "a", "right_sha256": "a", "size_bytes": 1}


@pytest.fixture
def old(empty: Database) -> Database:
    """A database of version 0.1.0 with a row of every kind."""
    move(empty, "0004")
    metadata = MetaData()
    metadata.reflect(empty.engine)
    with empty.write() as session:
        for name, values in OLD:
            table = metadata.tables[name]
            for column in table.columns:
                if isinstance(column.type, JSON):
                    column.type = JSON(none_as_null=True)
            filled = {key: value for key, value in FILLED.items() if key in table.columns}
            session.execute(table.insert().values({**filled, **values}))
    return empty


def contents(database: Database) -> dict[str, list[dict[str, Any]]]:
    metadata = MetaData()
    metadata.reflect(database.engine)
    with database.read() as session:
        return {
            name: [
                dict(row)
                for row in session.execute(select(table).order_by(*table.primary_key.columns)).mappings()
            ]
            for name, table in metadata.tables.items()
            if name != "alembic_version"
        }


def test_results_of_version_0_1_0_are_kept_to_the_last_bit(old: Database) -> None:
    upgrade(old.url)
    with old.read() as session:
        _, measured = measurements.get(session, "s", "PRE")
        first, second = measurements.triads(session, "t")
        poses = measurements.poses(session, "t")
        features = measurements.features(session, "t")
        summary = calibration_checks.summary(session, "r")
    assert first.position_mm == [X, Y, Z]
    assert (first.rotation, first.covariance) == (ROTATION, COVARIANCE)
    assert (first.angles_deg, first.error_mm, first.balls["XX"].left) == ([89.0, 91.0, 1.4], 0.25, [5.0, 6.0])
    assert (second.reason, second.label_reason) == ("not determined", "the gaps do not decide")
    assert second.position_mm is None
    assert list(poses) == ["L1"]
    assert isinstance(poses["L1"], Pose)
    assert (features.left[0].x, features.left[0].visible_fraction, features.right) == (1.5, None, [])
    assert measured.result["rig_check"]["p_value"] == RIG_CHECK["chance"]
    assert measured.result["rig_check"]["rotation_deg"] == RIG_CHECK["turn_deg"]
    assert (measured.result["version"], measured.result["templates"]) == ("0.1.0", None)
    assert measured.created_at == TIME
    assert (summary.stages, summary.old) == (1, 1)


def test_jobs_and_events_of_version_0_1_0_are_kept(old: Database) -> None:
    upgrade(old.url)
    with old.read() as session:
        measured, calibrated, failed = (jobs.get(session, job) for job in ("j", "k", "l"))
        events = session.scalars(select(Event).order_by(Event.seq)).all()
    assert (measured.kind, measured.subject_id, measured.surgery_id) == (STAGE_JOB, "t", "s")
    assert (calibrated.kind, calibrated.subject_id, calibrated.payload) == (CALIBRATION_JOB, "r", {})
    assert (failed.state, failed.error) == (JobState.FAILED, {"code": "x", "detail": "y"})
    assert (failed.attempts, failed.enqueued_at, failed.finished_at) == (2, TIME, TIME)
    assert measured.error is None
    assert [(e.seq, e.actor_kind, e.actor_name, e.action, e.surgery_id) for e in events] == [
        (1, "http", "", "surgery:created", "s"),
        (4, "worker", "", "stage:measured", "s"),
        (5, "http", "", "calibration:submitted", None),
    ]
    new_surgery(old)
    with old.read() as session:
        assert session.scalars(select(Event.seq).order_by(Event.seq)).all()[-1] == 6


def test_the_events_of_version_0_1_0_are_chained(old: Database) -> None:
    upgrade(old.url)
    new_surgery(old)
    with old.read() as session:
        chain = verify_chain(session)
    assert (chain.events, chain.last, chain.reason) == (4, 6, None)


RECORD = ("events", "images", "stages", "measurements", "triads", "features")


@pytest.mark.parametrize("table", RECORD)
def test_no_row_of_the_record_can_be_changed_or_deleted(empty: Database, table: str) -> None:
    upgrade(empty.url)
    succeed(empty, claimed(empty, new_stage(empty, new_surgery(empty)).job.id))
    with empty.read() as session:
        column = session.execute(text(f"SELECT * FROM {table}")).keys()  # noqa: S608
    statements = [f"DELETE FROM {table}", *(f"UPDATE {table} SET {name} = {name}" for name in column)]  # noqa: S608
    if empty.engine.dialect.name == "postgresql":
        statements.append(f"TRUNCATE {table} CASCADE")
    else:
        statements.append(f"INSERT OR REPLACE INTO {table} SELECT * FROM {table}")  # noqa: S608
    for statement in statements:
        with pytest.raises(IntegrityError, match=r"never changes|follows"), empty.write() as session:
            session.execute(text(statement))


def test_reports_of_version_0_1_0_are_shown(old: Database) -> None:
    upgrade(old.url)
    with old.read() as session:
        report = calibrations.report_of(calibrations.get_with_report(session, "r"))
    (removed,) = report.report["removed"]
    assert RemovedPoint.model_validate(removed).residual_px == 2.5


def test_the_way_back_to_version_0_1_0_loses_nothing(old: Database) -> None:
    before = contents(old)
    upgrade(old.url)
    assert set(contents(old)) == set(before) - {"changes"} | {"events"} | LATER
    move(old, "0004")
    assert contents(old) == before


@pytest.mark.parametrize("revision", ["0004", REVISION])
def test_no_migration_lets_calibrations_change(old: Database, revision: str) -> None:
    upgrade(old.url)
    move(old, revision)
    for table in ("calibrations", "calibration_requests", "calibration_shots", "calibration_reports"):
        with pytest.raises(IntegrityError, match="never change"), old.write() as session:
            session.execute(text(f"DELETE FROM {table}"))  # noqa: S608


def test_work_goes_on_after_an_upgrade(old: Database) -> None:
    upgrade(old.url)
    request = new_request(old)
    with old.read() as session:
        assert calibrations.get(session, "r").name == "cart"
        stage = stages.get(session, "s", "POST")
    assert stage.job.state is JobState.FAILED
    assert request != "r"


def test_the_way_back_loses_spines_and_their_jobs_and_nothing_else(empty: Database) -> None:
    upgrade(empty.url)
    surgery = new_surgery(empty)
    stage = new_stage(empty, surgery)
    succeed(empty, claimed(empty, stage.job.id))
    with empty.write() as session:
        spine_setups.put(session, surgery, spine_setup(), NOON, CLIENT)
        spine_job = spines.submit(session, surgery, NOON)
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
        assert spines.submit(session, surgery, NOON) is not None


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


def test_a_copy_of_the_database_is_made_before_a_migration(old: Database) -> None:
    path = sqlite_path(old.url)
    copy = upgrade(old.url)
    if path is None:  # on a server, whose administrator makes the copies
        assert copy is None
        return
    assert copy == path.with_name("x-revision-0004.sqlite")
    assert copy.stat().st_mode & 0o777 == 0o600
    with closing(sqlite3.connect(copy)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        assert connection.execute("SELECT version_num FROM alembic_version").fetchall() == [("0004",)]
        assert connection.execute("SELECT count(*) FROM triads").fetchall() == [(2,)]
    assert upgrade(old.url) is None
    move(old, "0005")
    again = upgrade(old.url)
    assert again == path.with_name("x-revision-0005.sqlite")
    move(old, "0005")
    assert upgrade(old.url) == path.with_name("x-revision-0005-1.sqlite")
    move(old, "0005")
    assert upgrade(old.url, keep_copy=False) is None


def test_a_database_of_another_program_is_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "places.sqlite"
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("CREATE TABLE bookmarks (x)")
        connection.commit()
    with pytest.raises(DatabaseNotReadyError, match="another program"):
        upgrade(f"sqlite:///{file}")
    with closing(sqlite3.connect(file)) as connection:
        assert connection.execute("SELECT name FROM sqlite_master").fetchall() == [("bookmarks",)]


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
