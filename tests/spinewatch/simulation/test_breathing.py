import numpy as np
import pytest

from spinewatch.simulation.breathing import (
    BreathingParameters,
    breath_course,
    breathed,
    mean_breath_course,
)
from spinewatch.simulation.scoliosis import LEVELS
from spinewatch.spine.configuration import SpinePoses

STRAIGHT = SpinePoses(
    np.column_stack([np.zeros((17, 2)), np.linspace(480.0, 0.0, 17)]), np.stack([np.eye(3)] * 17)
)


def test_a_breath_returns_after_four_seconds_at_fifteen_a_minute() -> None:
    times = np.linspace(0, 4, 9)
    assert breath_course(times + 4) == pytest.approx(breath_course(times))
    assert breath_course(np.array([0.0, 1.0, 2.0])) == pytest.approx([1, 0.125, 0])


def test_phase_shifts_the_breath() -> None:
    half = BreathingParameters(phase=0.5)
    assert breath_course(np.array([2.0]), half) == pytest.approx([1.0])


@pytest.mark.parametrize(("exponent", "mean"), [(2, 1 / 2), (4, 3 / 8), (6, 5 / 16)])
def test_mean_of_a_power_of_a_cosine(exponent: int, mean: float) -> None:
    assert mean_breath_course(BreathingParameters(exponent=exponent, phase=0.3)) == pytest.approx(mean)


def test_the_back_rises_by_two_millimetres_at_t8_and_hardly_at_l5() -> None:
    moved = breathed(STRAIGHT, 1.0)
    shift = moved.position_mm - STRAIGHT.position_mm
    assert shift[LEVELS.index("T8")] == pytest.approx([-2, 0, 0])
    assert abs(shift[-1, 0]) < 0.5
    assert np.all(shift[:, 1:] == 0)


def test_vertebrae_tilt_along_the_slope() -> None:
    moved = breathed(STRAIGHT, 1.0)
    # Above T8 the spine comes back to the front going up: its axis leans forwards.
    assert moved.rotation[4, 0, 2] == pytest.approx(
        (moved.position_mm[3, 0] - moved.position_mm[5, 0]) / 60, rel=1e-3
    )
    assert moved.rotation[4, 0, 2] > 0


def test_no_breath_is_no_motion() -> None:
    moved = breathed(STRAIGHT, 0.0)
    assert moved.position_mm == pytest.approx(STRAIGHT.position_mm)
    assert moved.rotation == pytest.approx(STRAIGHT.rotation)
