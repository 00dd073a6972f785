from __future__ import annotations

import numpy as np
import pytest

from spinewatch.geometry.splines import linear_weights, natural_spline_weights
from spinewatch.spine.interpolation_model import (
    InterpolationParameters,
    interpolation_error,
    position_amplitude,
    rotation_amplitude,
)

PARAMETERS = InterpolationParameters(
    amplitude_share=0.5, cross_axis=0.25, rotation_amplitude_deg=1.0, position_amplitude_mm=2.0
)


def test_the_error_between_two_knots_by_hand() -> None:
    # Half-way between knots 2 levels apart, with correlation k(1) and k(2): var = 1 + (2 + 2 k(2)) / 4 - 2 k(1).
    places, ell, s = np.array([0.0, 1.0, 2.0]), 1.5, 0.3
    knots, at = np.array([0, 2]), np.array([1])
    factor = interpolation_error(
        places,
        knots,
        at,
        linear_weights(places[knots], places[at]),
        amplitude=np.array([0.0, 2.0, 4.0]),
        irregularity=s,
        correlation_levels=ell,
    )
    k1, k2 = np.exp(-0.5 / ell**2), np.exp(-2 / ell**2)
    smooth = 1 + (1 + k2) / 2 - 2 * k1
    expected = [1.5 * s**2, 4 * smooth + 1.5 * s**2, 16 * smooth + 1.5 * s**2]
    assert np.allclose((factor**2).sum(axis=2), [expected])


def test_the_error_is_that_of_random_functions() -> None:
    rng = np.random.default_rng(1)
    places = np.arange(9.0)
    knots, at = np.array([0, 3, 5, 8]), np.array([1, 2, 4, 6, 7])
    W = natural_spline_weights(places[knots], places[at])
    K = np.exp(-0.5 * np.subtract.outer(places, places) ** 2 / 2.7**2) * 9 + 0.25 * np.eye(9)
    values = np.linalg.cholesky(K) @ rng.standard_normal((9, 20000))
    errors = values[at] - W @ values[knots]
    factor = interpolation_error(
        places, knots, at, W, amplitude=np.full(3, 3.0), irregularity=0.5, correlation_levels=2.7
    )
    assert np.allclose(factor[:, 1] @ factor[:, 1].T, np.cov(errors), rtol=0.08, atol=0.01)
    # Axes are independent.
    assert np.allclose(factor[:, 0] @ factor[:, 1].T, 0)


def test_the_error_grows_with_the_distance_from_markers() -> None:
    places = np.arange(9.0)
    knots, at = np.array([0, 8]), np.arange(1, 8)
    factor = interpolation_error(
        places,
        knots,
        at,
        linear_weights(places[knots], places[at]),
        amplitude=np.ones(3),
        irregularity=0.0,
        correlation_levels=2.7,
    )
    sd = np.sqrt((factor[:, 0] ** 2).sum(axis=1))
    assert (np.diff(sd[:4]) > 0).all()
    assert np.allclose(sd, sd[::-1])


def test_amplitudes_of_rotations_by_hand() -> None:
    angles = np.array([[0.0, 0, 0], [10, 1, 0], [-6, 0, 0]])
    assert rotation_amplitude(angles, PARAMETERS) == pytest.approx([8, 2, 2])
    assert rotation_amplitude(0 * angles, PARAMETERS) == pytest.approx([1, 1, 1])


def test_amplitudes_of_positions_ignore_a_straight_line() -> None:
    places = np.array([0.0, 1.0, 4.0])
    line = np.outer(places, [3.0, -5, 30])
    assert position_amplitude(line, places, PARAMETERS) == pytest.approx([2, 2, 2])
    line[1] += [0, 10, 0]
    assert position_amplitude(line, places, PARAMETERS) == pytest.approx([2, 5, 2])
