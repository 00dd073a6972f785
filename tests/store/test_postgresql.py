"""Writers on PostgreSQL take turns, wait for a limited time, and give up what they hold when they are gone."""

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import psycopg
import pytest
from sqlalchemy import func, make_url, select, text
from sqlalchemy.exc import DBAPIError, OperationalError

from migrations.history import upgrade
from store import calibrations, stage_submission
from store.database import Database
from store.errors import StageExistsError
from store.postgresql import connection_options
from store.revision import REVISION, current_revision
from store.stage_submission import NewStage
from store.tables.events import Event
from store.tables.jobs import Job
from store.tables.stages import Stage
from store.tables.surgeries import Surgery
from store.unavailable import is_unavailable
from tests.backends import new_database
from tests.store.builders import CLIENT, NOON, RIG, image, new_surgery

CARTS = 8


@pytest.fixture
def url(tmp_path: Path, postgresql: None) -> Iterator[str]:
    with new_database(tmp_path, tables=False, storage="postgresql") as url:
        yield url


@pytest.fixture
def database(url: str) -> Iterator[Database]:
    upgrade(url)
    database = Database(url)
    yield database
    database.close()


def in_turn(database: Database, work: str) -> None:
    """Take a stage name that others want too; raises ``StageExistsError`` for all but the first."""
    with database.write() as session:
        surgery = session.scalars(select(Surgery)).one()
        calibration = calibrations.add(session, RIG, NOON, CLIENT)
        new = NewStage("PRE", image(work.encode()), image(b"right"), None)
        stage_submission.submit(session, surgery, calibration, new, NOON, CLIENT)


def test_of_carts_that_race_for_a_stage_name_one_wins_and_the_others_are_told(database: Database) -> None:
    new_surgery(database)
    together = threading.Barrier(CARTS)

    def cart(number: int) -> str:
        together.wait()
        try:
            in_turn(database, f"left {number}")
        except StageExistsError:
            return "told"
        return "won"

    with ThreadPoolExecutor(CARTS) as pool:
        assert sorted(pool.map(cart, range(CARTS))) == ["told"] * (CARTS - 1) + ["won"]
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(Stage)) == 1
        assert session.scalar(select(func.count()).select_from(Job)) == 1
        numbers = session.scalars(select(Event.seq).order_by(Event.seq)).all()
    assert numbers == sorted(set(numbers))


def test_readers_do_not_wait_for_a_writer(database: Database) -> None:
    with database.write() as writer:
        writer.execute(text("SELECT 1"))
        with database.read() as reader:
            assert reader.scalar(select(func.count()).select_from(Stage)) == 0


def test_a_writer_waits_for_a_limited_time(database: Database) -> None:
    with database.write() as holder:
        holder.execute(text("SELECT 1"))
        with pytest.raises(OperationalError) as raised, database.write() as waiting:
            waiting.execute(text("SELECT 1"))
    assert is_unavailable(raised.value)
    assert isinstance(raised.value.orig, psycopg.errors.LockNotAvailable)


def test_a_writer_that_stops_in_its_transaction_loses_the_lock(database: Database) -> None:
    stopped = Database(database.url)

    def stop_inside() -> None:
        with stopped.write() as session:
            session.execute(text("SET LOCAL idle_in_transaction_session_timeout = '1s'"))
            new_surgery(database)  # waits for the lock, for at most ten seconds
            session.execute(text("SELECT 1"))

    with pytest.raises(DBAPIError) as raised:
        stop_inside()
    assert is_unavailable(raised.value)
    stopped.close()
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(Surgery)) == 1


def test_a_connection_that_the_server_closed_is_replaced(database: Database) -> None:
    with database.read() as session:
        session.execute(text("SELECT 1"))
    plain = make_url(database.url).set(drivername="postgresql").render_as_string(hide_password=False)
    with closing(psycopg.connect(plain, autocommit=True)) as server:
        server.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity"
            " WHERE datname = current_database() AND pid <> pg_backend_pid()"
        )
    new_surgery(database)


def test_hosts_that_migrate_together_take_turns(url: str) -> None:
    hosts = 4
    together = threading.Barrier(hosts)

    def host(_: int) -> None:
        together.wait()
        upgrade(url)

    with ThreadPoolExecutor(hosts) as pool:
        list(pool.map(host, range(hosts)))
    database = Database(url)
    assert current_revision(database) == REVISION
    new_surgery(database)
    database.close()


def test_a_new_connection_has_limits_and_the_url_may_set_its_own(database: Database) -> None:
    limits = ("lock_timeout", "statement_timeout", "idle_in_transaction_session_timeout", "tcp_user_timeout")
    with database.read() as session:
        assert all(session.scalar(text(f"SHOW {name}")) not in {"0", "0ms"} for name in limits)
    with database.write(patient=True) as session:
        assert [session.scalar(text(f"SHOW {name}")) for name in limits[:3]] == ["0"] * 3
    with database.write() as session:
        assert session.scalar(text("SHOW lock_timeout")) == "10s"
    assert "connect_timeout" in connection_options(make_url(database.url))
    assert "connect_timeout" not in connection_options(make_url("postgresql://h/d?connect_timeout=60"))
