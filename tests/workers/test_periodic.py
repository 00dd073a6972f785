import threading

import structlog
from sqlalchemy.exc import OperationalError

from tests.patience import PATIENCE_S
from workers.periodic import start_periodic


def test_an_action_is_repeated_although_it_fails_until_it_is_stopped() -> None:
    stop, third = threading.Event(), threading.Event()
    rounds: list[str] = []

    def action() -> None:
        rounds.append(threading.current_thread().name)
        if len(rounds) == 3:
            third.set()
        raise RuntimeError("the database is busy")

    start_periodic("sweep", 0.01, stop, action)
    assert third.wait(PATIENCE_S)
    stop.set()
    for thread in threading.enumerate():
        if thread.name == "sweep":
            thread.join(PATIENCE_S)
            assert not thread.is_alive()
    assert set(rounds) == {"sweep"}


def test_a_database_that_cannot_be_used_is_one_line_without_a_traceback() -> None:
    stop, failed = threading.Event(), threading.Event()
    errors: list[Exception] = [
        RuntimeError("a defect"),
        OperationalError("UPDATE", {"at": 1}, Exception("database or disk is full")),
    ]

    def action() -> None:
        if not errors:
            failed.set()
            return
        raise errors.pop()

    with structlog.testing.capture_logs() as lines:
        start_periodic("report", 0.01, stop, action)
        assert failed.wait(20)
        stop.set()
    full, defect = lines
    assert (full["event"], full["error"]) == ("round_failed", "database or disk is full")
    assert "exc_info" not in full
    assert defect["exc_info"]
