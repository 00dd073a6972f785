from collections.abc import Iterator

import pytest

from commands.shared.watchdog import Notifier, Watchdog, notifier


@pytest.fixture
def watchdog(monkeypatch: pytest.MonkeyPatch) -> Iterator[Watchdog]:
    watchdog = Watchdog(seconds=3)
    for name, value in watchdog.environment.items():
        monkeypatch.setenv(name, value)
    yield watchdog
    watchdog.close()


@pytest.fixture
def beat(watchdog: Watchdog) -> Iterator[Notifier]:
    beat = notifier()
    assert beat is not None
    yield beat
    beat.close()


def rounds(watchdog: Watchdog, *seconds: float) -> list[bool]:
    return [watchdog.is_silent(second) for second in seconds]


def test_silence_counts_from_the_first_sign_of_life(watchdog: Watchdog, beat: Notifier) -> None:
    assert not any(rounds(watchdog, *range(10)))
    beat()
    beat()
    assert rounds(watchdog, 10, 11, 12, 13, 14) == [False, False, False, False, True]
    beat()
    assert rounds(watchdog, 15, 16, 17) == [False] * 3


def test_time_in_which_the_supervisor_did_not_run_does_not_count(watchdog: Watchdog, beat: Notifier) -> None:
    beat()
    assert rounds(watchdog, 0, 100, 200) == [False] * 3


def test_without_a_supervisor_there_is_no_notifier(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    assert notifier() is None


def test_a_sign_of_life_never_waits_or_fails(watchdog: Watchdog, beat: Notifier) -> None:
    for _ in range(10_000):
        beat()  # more than the socket holds
    watchdog.close()
    beat()
