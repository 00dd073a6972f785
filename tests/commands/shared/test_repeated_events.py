import io
import logging
from contextlib import suppress

import pytest
from sqlalchemy.exc import OperationalError

from commands.shared import repeated_events
from commands.shared.repeated_events import RepeatedEvents


class Log:
    """A logger whose lines and clock a test controls."""

    def __init__(self) -> None:
        self.now = 0.0
        self.stream = io.StringIO()
        self.logger = logging.Logger("tested")
        handler = logging.StreamHandler(self.stream)
        handler.setFormatter(logging.Formatter("%(levelname)s %(message)s"))
        handler.addFilter(RepeatedEvents())
        self.logger.addHandler(handler)

    @property
    def lines(self) -> list[str]:
        return self.stream.getvalue().splitlines()


@pytest.fixture
def log(monkeypatch: pytest.MonkeyPatch) -> Log:
    log = Log()
    monkeypatch.setattr(repeated_events, "monotonic", lambda: log.now)
    return log


def test_an_event_that_repeats_is_logged_once_a_minute_with_its_number(log: Log) -> None:
    for second in range(180):
        log.now = second
        log.logger.error({"event": "round_failed", "thread": "sweep", "error": "disk full"})
    assert len(log.lines) == 3
    assert "repeated" not in log.lines[0]
    assert "'repeated': 59" in log.lines[1]


def test_a_plain_record_repeats_whatever_its_values(log: Log) -> None:
    for second in range(62):
        log.now = second
        log.logger.error("Error in task %s", second)
    assert log.lines == ["ERROR Error in task 0", "ERROR Error in task 60 (repeated 59 times)"]


def test_what_differs_is_logged(log: Log) -> None:
    for thread in ("sweep", "heartbeat"):
        for error in ("full", "locked"):
            log.logger.warning({"event": "round_failed", "thread": thread, "error": error})
    assert len(log.lines) == 4


def test_events_of_jobs_and_requests_and_plain_information_are_never_left_out(log: Log) -> None:
    for _ in range(3):
        log.logger.warning({"event": "job_failed", "job_id": "7"})
        log.logger.error({"event": "unexpected_error", "request_id": "r"})
        log.logger.info({"event": "request"})
    assert len(log.lines) == 9


def test_what_each_request_would_say_of_the_database_is_left_out(log: Log) -> None:
    for n in range(3):
        log.logger.error({"event": "database_unavailable", "request_id": str(n), "error": "locked"})
    assert len(log.lines) == 1


def test_the_parameters_of_a_statement_make_no_difference(log: Log) -> None:
    for n in range(3):
        with suppress(OperationalError):
            try:
                raise OperationalError("UPDATE", {"at": n}, Exception("disk full"))
            except OperationalError:
                log.logger.error({"event": "round_failed", "exc_info": True})
                raise
    with suppress(ValueError):
        try:
            raise ValueError("another")
        except ValueError as error:
            log.logger.error({"event": "round_failed", "exc_info": error})
            raise
    assert sum(line.startswith("ERROR") for line in log.lines) == 2


def test_what_is_known_stays_small(log: Log) -> None:
    for n in range(1000):
        log.logger.error({"event": f"event-{n}"})
    (found,) = (f for f in log.logger.handlers[0].filters if isinstance(f, RepeatedEvents))
    assert len(log.lines) == 1000
    assert len(found._known) <= 256
