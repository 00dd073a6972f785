from datetime import UTC, datetime, timedelta, timezone

import pytest
from sqlalchemy import select
from sqlalchemy.exc import StatementError

from store.clock import utc_now
from store.database import Database
from store.tables.stages import Stage
from tests.store.builders import NOON, new_stage, new_surgery


def test_now_is_aware_and_utc() -> None:
    assert utc_now().tzinfo is UTC
    assert abs(utc_now() - datetime.now(UTC)) < timedelta(seconds=1)


def test_times_come_back_aware_and_naive_ones_are_refused(database: Database) -> None:
    stage = new_stage(database, new_surgery(database))
    with database.read() as session:
        assert session.scalars(select(Stage.created_at)).all() == [NOON]
    with pytest.raises(StatementError), database.write() as session:
        session.get_one(Stage, stage.id).captured_at = datetime(2026, 1, 1)


def test_a_time_of_another_zone_is_stored_in_utc(database: Database) -> None:
    local = NOON.astimezone(timezone(timedelta(hours=5)))
    stage = new_stage(database, new_surgery(database), captured_at=local)
    with database.read() as session:
        found = session.get_one(Stage, stage.id).captured_at
    assert found == NOON
    assert found is not None
    assert found.tzinfo is UTC
