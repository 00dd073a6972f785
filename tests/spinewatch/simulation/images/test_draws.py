import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.simulation.images.draws import beside, leaning, log_uniform, near, unit_vector

seeds = st.integers(0, 10_000)


@given(seeds, st.floats(0.01, 1), st.floats(1.5, 100))
def test_log_uniform_numbers_are_within_their_limits(seed: int, low: float, ratio: float) -> None:
    value = log_uniform(np.random.default_rng(seed), low, low * ratio)
    assert low * (1 - 1e-9) <= value <= low * ratio * (1 + 1e-9)


def test_half_of_the_log_uniform_numbers_are_below_the_geometric_mean() -> None:
    rng = np.random.default_rng(0)
    assert np.mean([log_uniform(rng, 1, 100) < 10 for _ in range(2000)]) == pytest.approx(0.5, abs=0.04)


def test_a_unit_vector_has_its_angles() -> None:
    assert unit_vector(np.pi / 2, np.pi / 2) == pytest.approx([0, 1, 0], abs=1e-6)
    assert unit_vector(0, 1.0) == pytest.approx([0, 0, 1])


@given(seeds, st.floats(0, 40), st.floats(1, 40))
def test_leaning_vectors_have_an_angle_within_the_limits(seed: int, low: float, width: float) -> None:
    up = unit_vector(0.3, 1.0)
    vector = leaning(np.random.default_rng(seed), up, low, low + width)
    assert np.linalg.norm(vector) == pytest.approx(1, abs=1e-5)
    assert low - 0.1 <= np.degrees(np.arccos(np.clip(vector @ up, -1, 1))) <= low + width + 0.1


def test_vectors_near_another_one_spread_by_the_stated_angle() -> None:
    rng = np.random.default_rng(1)
    vectors = np.array([near(rng, unit_vector(0, 0), 5) for _ in range(2000)])
    assert np.linalg.norm(vectors, axis=1) == pytest.approx(1, abs=1e-5)
    assert np.degrees(vectors[:, :2].std(axis=0)) == pytest.approx(5, rel=0.1)


@given(seeds, st.floats(0, 5), st.floats(-5, 5))
def test_a_point_beside_the_origin_has_its_distance_and_height(
    seed: int, distance: float, height: float
) -> None:
    point = beside(np.random.default_rng(seed), distance, height)
    assert np.hypot(*point[:2]) == pytest.approx(distance, abs=1e-5)
    assert point[2] == pytest.approx(height, abs=1e-5)
