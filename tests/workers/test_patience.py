import pytest
from sqlalchemy import create_engine, text
from sqlalchemy.exc import OperationalError

from store.errors import DatabaseNotReadyError
from workers.patience import patiently

LOCKED = OperationalError("BEGIN IMMEDIATE", None, Exception("database is locked"))


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The times that were slept, which the clock follows."""
    slept: list[float] = []
    monkeypatch.setattr("workers.patience.time.monotonic", lambda: sum(slept))
    monkeypatch.setattr("workers.patience.time.sleep", slept.append)
    return slept


def failing(times: int, error: Exception) -> list[Exception]:
    return [error] * times


def test_a_transaction_is_repeated_until_the_database_is_back(clock: list[float]) -> None:
    errors = failing(90, LOCKED)

    def action() -> str:
        if errors:
            raise errors.pop()
        return "stored"

    assert patiently(action, 60) == "stored"
    assert sum(clock) == 45


def test_it_ends_after_a_time(clock: list[float]) -> None:
    def action() -> str:
        raise LOCKED

    with pytest.raises(OperationalError):
        patiently(action, 60)
    assert 60 < sum(clock) < 62


def test_another_error_is_raised_at_once(clock: list[float]) -> None:
    def action() -> str:
        raise ValueError("a defect")

    with pytest.raises(ValueError, match="a defect"):
        patiently(action, 60)
    assert clock == []


def test_missing_tables_fail_at_once_by_name(clock: list[float]) -> None:
    def action() -> None:
        create_engine("sqlite://").connect().execute(text("SELECT 1 FROM nothing"))

    with pytest.raises(DatabaseNotReadyError, match="spinewatch db upgrade"):
        patiently(action, 60)
    assert clock == []
