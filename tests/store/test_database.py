import threading
from datetime import datetime
from pathlib import Path

import pytest
from sqlalchemy import select, text
from sqlalchemy.exc import IntegrityError, StatementError
from sqlalchemy.orm import Session

from store import events
from store.database import Database
from store.errors import DatabaseNotReadyError
from store.revision import require_revision
from store.tables import Calibration, Change, Job, JobState, Stage
from tests.store.builders import NOON, new_stage, new_surgery


def test_sqlite_is_set_up_to_keep_what_it_was_given(record: Database) -> None:
    with record.reading() as session:
        found = [
            session.scalar(text(f"PRAGMA {name}"))
            for name in ("journal_mode", "foreign_keys", "synchronous", "busy_timeout")
        ]
    assert found == ["wal", 1, 2, 10_000]


def test_foreign_keys_hold(record: Database) -> None:
    with pytest.raises(IntegrityError), record.writing() as session:
        session.add(Job(id="j", stage_id="none", state=JobState.QUEUED, rung_at=NOON, created_at=NOON))


def test_an_error_leaves_nothing(record: Database) -> None:
    def break_off() -> None:
        with record.writing() as session:
            events.append(session, NOON, events.Action.SURGERY_CREATED, "s")
            session.flush()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        break_off()
    with record.reading() as session:
        assert session.scalars(select(Change)).all() == []


def count_up(session: Session) -> None:
    """Read, then write what depends on it."""
    seen = len(session.scalars(select(Change.seq)).all())
    events.append(session, NOON, events.Action.SURGERY_CREATED, str(seen))


def test_writers_that_read_first_take_turns(record: Database) -> None:
    def write() -> None:
        for _ in range(25):
            with record.writing() as session:
                count_up(session)

    threads = [threading.Thread(target=write) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with record.reading() as session:
        assert session.scalars(select(Change.subject_id).order_by(Change.seq)).all() == [
            str(n) for n in range(100)
        ]


def test_a_reader_sees_one_state_while_others_write(record: Database) -> None:
    count = select(Change.seq)
    with record.reading() as reader:
        before = reader.scalars(count).all()
        with record.writing() as writer:
            count_up(writer)
        assert reader.scalars(count).all() == before
    with record.reading() as reader:
        assert len(reader.scalars(count).all()) == len(before) + 1


def test_times_come_back_aware_and_naive_ones_are_refused(record: Database) -> None:
    stage = new_stage(record, new_surgery(record))
    with record.reading() as session:
        assert session.scalars(select(Stage.created_at)).all() == [NOON]
    with pytest.raises(StatementError), record.writing() as session:
        session.get_one(Stage, stage.id).captured_at = datetime(2026, 1, 1)


def test_json_has_no_nan(record: Database) -> None:
    with pytest.raises(StatementError), record.writing() as session:
        session.add(Calibration(id="c", name="n", rig={"x": float("nan")}, created_at=NOON))


def test_numbers_of_changes_are_never_used_twice(record: Database) -> None:
    with record.writing() as session:
        count_up(session)
    with record.writing() as session:
        session.execute(text("DELETE FROM changes"))
    with record.writing() as session:
        count_up(session)
    with record.reading() as session:
        assert session.scalars(select(Change.seq)).all() == [2]


@pytest.mark.parametrize("url", ["nonsense", "nosuch://host/db"])
def test_a_url_that_means_nothing_is_named(url: str) -> None:
    with pytest.raises(DatabaseNotReadyError, match="SPINEWATCH_DATABASE_URL"):
        Database(url)


def test_nothing_is_made_by_looking(tmp_path: Path) -> None:
    record = Database(f"sqlite:///{tmp_path / 'none.sqlite'}")
    with pytest.raises(DatabaseNotReadyError, match="db upgrade"):
        require_revision(record)
    record.close()
    assert list(tmp_path.iterdir()) == []
