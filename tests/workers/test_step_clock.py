import pytest

from workers.step_clock import StepClock


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("workers.step_clock.time.monotonic", clock)
    return clock


def test_a_step_lasts_until_the_next_begins(clock: Clock) -> None:
    steps = StepClock()
    for step, seconds in (("decode", 0.5), ("detect", 2.0), ("decode", 0.25)):
        steps.begin(step)
        clock.now += seconds
    assert steps.seconds() == {"decode": 0.75, "detect": 2.0}


def test_steps_with_numbers_and_names_are_counted_together(clock: Clock) -> None:
    steps = StepClock()
    for step in ("find targets of shot 1 of 3", "find targets of shot 2 of 3", "PRE", "post"):
        steps.begin(step)
        clock.now += 1.0
    assert steps.seconds() == {"find targets": 2.0, "other": 2.0}


def test_a_job_without_steps_has_no_times() -> None:
    assert StepClock().seconds() == {}
