import numpy as np
import pytest

from spinewatch.spine.smoothing import smoothed

VALUES = np.array([0.0, 4.0, 9.0, 11.0, 8.0, 2.0])


def test_without_errors_nothing_is_smoothed() -> None:
    mean, covariance = smoothed(VALUES, np.zeros((6, 6)), 3.0)
    assert np.array_equal(mean, VALUES)
    assert not covariance.any()


def test_the_mean_solves_the_least_squares_problem() -> None:
    sd, roughness = np.array([1.0, 0.5, 2.0, 1.0, 1.0, 0.7]), 1.5
    mean, covariance = smoothed(VALUES, np.diag(sd**2), roughness)
    D = np.diff(np.eye(6), 3, axis=0)
    N = np.diag(sd**-2.0) + D.T @ D / roughness**2
    assert mean == pytest.approx(np.linalg.solve(N, VALUES / sd**2))
    assert covariance == pytest.approx(np.linalg.inv(N))


def test_a_parabola_stays_and_an_error_that_all_share_is_no_roughness() -> None:
    parabola = np.arange(6.0) ** 2
    assert smoothed(parabola, np.eye(6), 0.1)[0] == pytest.approx(parabola)
    assert smoothed(VALUES, np.ones((6, 6)), 3.0)[0] == pytest.approx(VALUES)


def test_three_values_have_no_third_difference() -> None:
    mean, covariance = smoothed(VALUES[:3], np.eye(3), 0.1)
    assert np.array_equal(mean, VALUES[:3])
    assert np.array_equal(covariance, np.eye(3))
