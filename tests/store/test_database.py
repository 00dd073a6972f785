import threading
from pathlib import Path

import pytest
from sqlalchemy import select, text
from sqlalchemy.exc import IntegrityError, OperationalError, StatementError
from sqlalchemy.orm import Session

from store import events
from store.database import Database, sqlite_path
from store.errors import DatabaseNotReadyError
from store.tables.calibrations import Calibration
from store.tables.events import Event
from store.tables.measurements import Measurement
from tests.backends import about_the_sqlite_file, held_write_lock
from tests.store.builders import CLIENT, NOON


@about_the_sqlite_file
def test_sqlite_is_set_up_to_keep_what_is_committed(database: Database) -> None:
    with database.read() as session:
        found = [
            session.scalar(text(f"PRAGMA {name}"))
            for name in ("journal_mode", "foreign_keys", "synchronous", "busy_timeout")
        ]
    assert found == ["wal", 1, 2, 10_000]


@about_the_sqlite_file
def test_only_what_need_not_be_durable_is_committed_without_waiting_for_the_disk(database: Database) -> None:
    def level(*, durable: bool) -> int:
        with database.write(durable=durable) as session:
            return int(session.execute(text("PRAGMA synchronous")).scalar_one())

    assert [level(durable=durable) for durable in (True, False, False, True)] == [2, 1, 1, 2]


def test_the_wait_for_other_writers_is_as_long_as_asked(database: Database) -> None:
    def waits(lock_seconds: float | None) -> str:
        query = "PRAGMA busy_timeout" if sqlite_path(database.url) else "SHOW lock_timeout"
        with database.write(lock_seconds=lock_seconds) as session:
            return str(session.execute(text(query)).scalar_one())

    usual, short = ("10000", "50") if sqlite_path(database.url) else ("10s", "50ms")
    assert [waits(seconds) for seconds in (None, 0.05, None)] == [usual, short, usual]
    with held_write_lock(database.url), pytest.raises(OperationalError):
        waits(0.05)


def test_what_need_not_be_durable_is_seen_by_others_at_once(database: Database) -> None:
    with database.write(durable=False) as session:
        append(session)
    other = Database(database.url)
    with other.read() as session:
        assert len(session.scalars(select(Event)).all()) == 1
    other.close()


def test_foreign_keys_hold(database: Database) -> None:
    with pytest.raises(IntegrityError), database.write() as session:
        session.add(Measurement(stage_id="none", result={}, created_at=NOON))


def append(session: Session, subject: str = "s") -> None:
    events.append(session, NOON, CLIENT, events.Action.SURGERY_CREATED, subject)


def test_an_error_leaves_nothing(database: Database) -> None:
    def break_off() -> None:
        with database.write() as session:
            append(session)
            session.flush()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        break_off()
    with database.read() as session:
        assert session.scalars(select(Event)).all() == []


def count_up(session: Session) -> None:
    """Read, then write what depends on it."""
    append(session, str(len(session.scalars(select(Event.seq)).all())))


def test_writers_that_read_first_take_turns(database: Database) -> None:
    def write() -> None:
        for _ in range(25):
            with database.write() as session:
                count_up(session)

    threads = [threading.Thread(target=write) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as session:
        assert session.scalars(select(Event.subject_id).order_by(Event.seq)).all() == [
            str(n) for n in range(100)
        ]


def test_a_reader_sees_one_state_while_others_write(database: Database) -> None:
    numbers = select(Event.seq)
    with database.read() as reader:
        before = reader.scalars(numbers).all()
        with database.write() as writer:
            count_up(writer)
        assert reader.scalars(numbers).all() == before
    with database.read() as reader:
        assert len(reader.scalars(numbers).all()) == len(before) + 1


def test_json_has_no_nan(database: Database) -> None:
    with pytest.raises((StatementError, ValueError)), database.write() as session:
        session.add(Calibration(id="c", name="n", rig={"x": float("nan")}, created_at=NOON))


@pytest.mark.parametrize("url", ["nonsense", "nosuch://host/db"])
def test_a_url_that_cannot_be_used_is_named(url: str) -> None:
    with pytest.raises(DatabaseNotReadyError, match="SPINEWATCH_DATABASE_URL"):
        Database(url)


@pytest.mark.parametrize(
    ("url", "path"),
    [
        ("sqlite:///var/x.sqlite", Path("var/x.sqlite")),
        ("sqlite:////data/x.sqlite", Path("/data/x.sqlite")),
        ("sqlite://", None),
        ("postgresql+psycopg://host/db", None),
    ],
)
def test_the_file_of_a_url(url: str, path: Path | None) -> None:
    assert sqlite_path(url) == path
