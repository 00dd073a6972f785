import numpy as np

from spinewatch.geometry.covariance import covariance_factor


def test_factors_of_covariances() -> None:
    A = np.random.default_rng(1).standard_normal((6, 6))
    covariance = np.stack([A @ A.T, np.zeros((6, 6))])
    F = covariance_factor(covariance)
    assert np.allclose(F @ np.swapaxes(F, -1, -2), covariance)


def test_a_singular_covariance_has_a_factor() -> None:
    direction = np.array([1.0, -2.0, 0.5])
    F = covariance_factor(np.outer(direction, direction))
    assert np.allclose(F @ F.T, np.outer(direction, direction))


def test_an_eigenvalue_below_zero_by_rounding_counts_as_zero() -> None:
    assert np.array_equal(np.abs(covariance_factor(np.diag([4.0, -1e-18]))), np.diag([0.0, 2.0])[::-1])
