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


def test_a_step_that_contradicts_the_smoothness_is_kept_and_one_within_the_errors_is_not() -> None:
    rng = np.random.default_rng(2)
    slope = np.where(np.arange(12) < 6, 0.0, 1.0)
    for size, kept in ((30.0, 30.0), (2.0, 0.0)):
        values = size * slope + rng.normal(0, 1.0, 12)
        mean, _ = smoothed(values, np.eye(12), 0.1)
        assert mean[6] - mean[5] == pytest.approx(kept, abs=2.5)


def test_noise_makes_no_steps() -> None:
    rng = np.random.default_rng(3)
    D = np.diff(np.eye(12), 3, axis=0)
    gain = np.linalg.solve(D @ D.T + np.eye(9), D).T
    draws = [rng.normal(0, 1.0, 12) for _ in range(300)]
    plain = [
        np.allclose(smoothed(values, np.eye(12), 1.0)[0], values - gain @ D @ values) for values in draws
    ]
    assert np.mean(plain) > 0.99


def test_three_values_have_no_third_difference() -> None:
    mean, covariance = smoothed(VALUES[:3], np.eye(3), 0.1)
    assert np.array_equal(mean, VALUES[:3])
    assert np.array_equal(covariance, np.eye(3))
