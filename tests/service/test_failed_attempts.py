import pytest

from service import failed_attempts
from service.failed_attempts import MAX_FAILURES, WINDOW_SECONDS, FailedAttempts


def failed(address: str, count: int = MAX_FAILURES, now: float = 100.0) -> FailedAttempts:
    attempts = FailedAttempts()
    for _ in range(count):
        attempts.add(address, now)
    return attempts


def test_an_address_waits_after_many_failures_and_no_other_does() -> None:
    attempts = failed("10.0.0.1", MAX_FAILURES - 1)
    assert attempts.wait_seconds("10.0.0.1", 100.0) == 0
    attempts.add("10.0.0.1", 110.0)
    assert attempts.wait_seconds("10.0.0.1", 110.0) == WINDOW_SECONDS - 10
    assert attempts.wait_seconds("10.0.0.2", 110.0) == 0


def test_the_count_begins_at_zero_after_the_window() -> None:
    attempts = failed("10.0.0.1")
    after = 100.0 + WINDOW_SECONDS
    assert attempts.wait_seconds("10.0.0.1", after) == 0
    attempts.add("10.0.0.1", after)
    assert attempts.wait_seconds("10.0.0.1", after) == 0


def test_the_addresses_of_one_ipv6_network_are_one() -> None:
    attempts = failed("2001:db8::1")
    assert attempts.wait_seconds("2001:db8::ffff", 100.0) > 0
    assert attempts.wait_seconds("2001:db8:0:1::1", 100.0) == 0


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(failed_attempts, "MAX_ADDRESSES", 10)
    attempts = failed("first")
    for number in range(9):
        attempts.add(f"10.0.0.{number}", 100.0)
    assert attempts.wait_seconds("first", 100.0) > 0
    attempts.add("10.0.0.9", 100.0)
    assert attempts.wait_seconds("first", 100.0) == 0
    assert len(attempts._failures) == 10
