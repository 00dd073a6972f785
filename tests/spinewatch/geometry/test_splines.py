from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from spinewatch.arrays import Float
from spinewatch.geometry.splines import linear_weights, natural_spline_weights, secant_spline_weights

KINDS = [natural_spline_weights, secant_spline_weights, linear_weights]


def knots_of(seed: int, m: int) -> tuple[Float, Float, Float]:
    rng = np.random.default_rng(seed)
    knots = np.cumsum(rng.uniform(0.5, 3.0, m))
    return knots, np.linspace(knots[0], knots[-1], 17), rng.normal(0, 10, (m, 3))


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 10**6), st.integers(2, 12))
def test_natural_splines_agree_with_scipy(seed: int, m: int) -> None:
    knots, at, values = knots_of(seed, m)
    expected = CubicSpline(knots, values, bc_type="natural")(at)
    assert np.allclose(natural_spline_weights(knots, at) @ values, expected, atol=1e-9)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6), st.integers(2, 8))
def test_secant_splines_are_scipys_rotation_spline_of_small_angles(seed: int, m: int) -> None:
    knots, at, values = knots_of(seed, m)
    small = RotationSpline(knots, Rotation.from_rotvec(1e-6 * values))(at).as_rotvec() / 1e-6
    assert np.allclose(secant_spline_weights(knots, at) @ values, small, atol=1e-3)


@pytest.mark.parametrize("weights", KINDS)
@pytest.mark.parametrize("m", [2, 3, 7])
def test_straight_lines_and_the_knots_are_reproduced(weights: object, m: int) -> None:
    assert callable(weights)
    knots, at, values = knots_of(m, m)
    assert np.allclose(weights(knots, at) @ (3 + 2 * knots), 3 + 2 * at)
    assert np.allclose(weights(knots, knots) @ values, values)


def test_lines_by_hand() -> None:
    W = linear_weights(np.array([0.0, 2.0, 6.0]), np.array([1.0, 5.0]))
    assert np.allclose(W, [[0.5, 0.5, 0], [0, 0.25, 0.75]])


def test_a_natural_spline_by_hand() -> None:
    # Through 0, 1, 0: the second derivative in the middle is -3, so the value at 1/2 is 1/2 + 3/16.
    W = natural_spline_weights(np.array([0.0, 1.0, 2.0]), np.array([0.5]))
    assert np.allclose(W @ [0.0, 1.0, 0.0], 11 / 16)


def test_a_secant_spline_by_hand() -> None:
    # Slopes 1 and -1 at the ends: second derivatives 2, -4, 2, so the value at 1/2 is 1/2 + 1/8.
    W = secant_spline_weights(np.array([0.0, 1.0, 2.0]), np.array([0.5]))
    assert np.allclose(W @ [0.0, 1.0, 0.0], 5 / 8)
