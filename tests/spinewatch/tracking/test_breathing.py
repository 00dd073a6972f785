"""Harmonics of a common period."""

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.tracking.breathing import fit_harmonics, harmonic_basis, peak_to_peak

PERIODS = 1 / np.linspace(1 / 2, 1 / 10, 120)
TIMES = 0.37 * np.arange(24, dtype=np.float64)


def series(period: float, sd: float = 0.0, seed: int = 3) -> tuple[Float, Float]:
    """Two labels: one moves by 0.8 cos along z about 5, the other by 0.5 sin along x and 0.2 cos 2 along z about -1."""
    phase = 2 * np.pi * TIMES / period
    y = np.zeros((2, len(TIMES), 6))
    y[0, :, 2] = 5 + 0.8 * np.cos(phase)
    y[1, :, 0], y[1, :, 2] = 0.5 * np.sin(phase), -1 + 0.2 * np.cos(2 * phase)
    y += sd * np.random.default_rng(seed).normal(size=y.shape)
    return y, np.tile(np.eye(6) * max(sd, 1e-3) ** 2, (2, len(TIMES), 1, 1))


def test_period_and_coefficients_of_a_known_motion_come_out() -> None:
    y, C = series(3.7)
    fit = fit_harmonics(TIMES, y, C, np.ones((2, len(TIMES))), 2, PERIODS)
    assert fit.period_s == pytest.approx(3.7, abs=1e-3)
    assert fit.coefficients[0, :2, 2] == pytest.approx([5, 0.8], abs=1e-3)
    assert fit.coefficients[1, 2, 0] == pytest.approx(0.5, abs=1e-3)
    assert fit.coefficients[1, 3, 2] == pytest.approx(0.2, abs=1e-3)
    assert np.allclose(fit.motion(TIMES)[0, :, 2], y[0, :, 2] - 5, atol=1e-3)


def test_deviations_are_those_of_the_errors() -> None:
    truth, z_period, z_mean = 3.7, [], []
    for seed in range(60):
        y, C = series(truth, 0.1, seed)
        fit = fit_harmonics(TIMES, y, C, np.ones((2, len(TIMES))), 2, PERIODS)
        z_period.append((fit.period_s - truth) / fit.period_sd_s)
        z_mean.append((fit.coefficients[0, 0, 2] - 5) / np.sqrt(fit.covariance[0, 0, 2, 0, 2]))
    assert 0.75 < np.std(z_period) < 1.3
    assert 0.75 < np.std(z_mean) < 1.3


def test_a_pose_without_weight_has_no_influence() -> None:
    y, C = series(3.7)
    weight = np.ones((2, len(TIMES)))
    weight[0, 5] = 0
    y[0, 5] += 100
    fit = fit_harmonics(TIMES, y, C, weight, 2, PERIODS)
    assert fit.coefficients[0, 0, 2] == pytest.approx(5, abs=1e-3)
    assert not fit.residual[0, 5].any()
    assert fit.freedom == 6 * (47 - 10) - 1


def test_the_basis_is_constant_cosine_sine() -> None:
    basis = harmonic_basis(np.array([0.0, 0.5]), 2.0, 2)
    assert np.allclose(basis, [[1, 1, 0, 1, 0], [1, 0, 1, -1, 0]])


def test_peak_to_peak_of_an_ellipse_is_its_long_axis() -> None:
    coefficients = np.array([[3.0, 0, 0], [0, 1.0, 0]])
    amplitude, sd = peak_to_peak(coefficients, np.diag([0.04, 1, 1, 1, 1, 1.0]).reshape(2, 3, 2, 3))
    assert amplitude == pytest.approx(6)
    assert sd == pytest.approx(2 * 0.2)


def test_no_motion_has_no_amplitude() -> None:
    amplitude, sd = peak_to_peak(np.zeros((2, 3)), 0.01 * np.eye(6).reshape(2, 3, 2, 3))
    assert amplitude == 0
    assert sd > 0
