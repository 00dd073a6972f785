import pytest

from commands.shared import stopwatch
from commands.shared.stopwatch import Stopwatch


def test_times_of_steps_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter([10.0, 10.5, 11.0, 13.0, 13.25])
    monkeypatch.setattr(stopwatch, "perf_counter", lambda: next(times))
    clock = Stopwatch()
    clock("detect", 0.0)
    clock("match", 0.5)
    clock("detect", 0.7)
    assert clock.stop() == {"detect": 750.0, "match": 2000.0, "total": 3250.0}
