"""The interval of the angle of a rotation covers the truth at every angle and is never negative."""

import numpy as np
import pytest

from spinewatch.spine.rotation_angle import angle_interval


@pytest.mark.parametrize(
    "deviations", [(1.0, 1.0, 1.0), (1.0, 1.0, 3.0), (0.3, 1.0, 1.0), (1.0, 3.0), (1.0, 1.0)]
)
@pytest.mark.parametrize("length", [0.0, 0.5, 1.0, 2.0, 5.0, 20.0])
def test_it_covers_the_true_angle(deviations: tuple[float, ...], length: float) -> None:
    rng = np.random.default_rng(7)
    sd = np.array(deviations)
    true = np.zeros(len(sd))
    true[0] = length
    found = [angle_interval(true + sd * rng.standard_normal(len(sd)), np.diag(sd**2)) for _ in range(600)]
    inside = np.mean([low <= length <= high for low, high in found])
    assert 0.92 <= inside <= 0.995
    assert min(low for low, _ in found) >= 0


def test_the_angle_lies_in_its_interval() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        d, A = rng.normal(size=3) * rng.uniform(0, 10), rng.normal(size=(3, 3))
        low, high = angle_interval(d, A @ A.T)
        assert low <= np.linalg.norm(d) <= high


def test_far_from_zero_it_is_that_of_the_error_along_the_vector() -> None:
    low, high = angle_interval(np.array([0.0, 60.0, 0.0]), np.diag([1.0, 4.0, 1.0]))
    assert (low, high) == pytest.approx((60 - 3.92, 60 + 3.92), abs=0.05)


def test_no_error_and_no_turn() -> None:
    assert angle_interval(np.zeros(3), np.zeros((3, 3))) == (0.0, 0.0)
    assert angle_interval(np.array([3.0, 0.0, 4.0]), np.zeros((3, 3))) == pytest.approx((5.0, 5.0))


def test_half_a_turn_is_the_end() -> None:
    assert angle_interval(np.array([175.0, 0.0, 0.0]), 25 * np.eye(3))[1] == 180.0


def test_what_is_unknown_has_no_interval() -> None:
    assert np.isnan(angle_interval(np.full(3, np.nan), np.eye(3))).all()
