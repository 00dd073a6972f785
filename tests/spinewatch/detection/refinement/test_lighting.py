"""The inputs of the networks, as functions of the light."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.detection.refinement.lighting import (
    N_INPUTS,
    Lighting,
    lighting_inputs,
)

SLOPES = st.floats(-0.6, 0.6)
HEIGHTS = st.floats(0.7, 20.0)


@given(SLOPES, SLOPES, HEIGHTS)
def test_a_shadow_is_opposite_the_lamp_and_farther_from_higher_balls(
    u: float, v: float, height: float
) -> None:
    lamp = np.array([u, v])
    near, far = (Lighting.measured(lamp, h).inputs[4:6] for h in (height, 1.5 * height))
    assert near @ lamp <= 0
    assert np.linalg.norm(near) <= np.linalg.norm(far) + 1e-6 <= 4.001
    assert abs(near[0] * v - near[1] * u) < 1e-5


@given(SLOPES, SLOPES, HEIGHTS)
def test_a_height_that_is_not_measured_has_no_influence(u: float, v: float, height: float) -> None:
    no = np.array([False])
    inputs = lighting_inputs(np.array([[u, v]]), no, np.log([height]), no)[0]
    assert np.array_equal(inputs, Lighting.expected(np.array([u, v])).inputs)
    assert np.array_equal(inputs[2:], np.zeros(N_INPUTS - 2))


@given(SLOPES, SLOPES, HEIGHTS)
def test_mirrored_light_has_mirrored_inputs(u: float, v: float, height: float) -> None:
    light = Lighting.measured(np.array([u, v]), height)
    mirrored = Lighting.measured(np.array([-u, v]), height)
    assert light.turned((-1, 1)).inputs == pytest.approx(mirrored.inputs)
    rotated = Lighting.measured(np.array([-u, -v]), height)
    assert light.turned((-1, -1)).inputs == pytest.approx(rotated.inputs)


def test_a_lamp_at_the_horizon_has_a_finite_shadow() -> None:
    assert np.isfinite(Lighting.measured(np.array([1.0, 0.0]), 2.0).inputs).all()
