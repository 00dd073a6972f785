import pytest

from bench import large_balls
from bench.large_balls import LargeBalls
from spinewatch.simulation.images.families import UNUSUAL


def test_a_few_large_balls_are_found() -> None:
    examples = large_balls.draw(12, UNUSUAL)
    found = large_balls.measure(examples, usual=True)
    assert 0 < found.n <= 12
    assert found.found > 0.5
    assert found.median_px < 1.0
    assert len(large_balls.table({"usual looks": found}).rows) == 1


@pytest.mark.parametrize(("sure", "rms_px", "missed"), [(0.9, 0.05, 0), (0.5, 0.05, 1), (0.5, 0.2, 2)])
def test_bars_can_be_missed(sure: float, rms_px: float, missed: int) -> None:
    checks = large_balls.requirements(LargeBalls(100, 1.0, sure, rms_px, 0.05, 1.0))
    assert [check.holds for check in checks].count(False) == missed
