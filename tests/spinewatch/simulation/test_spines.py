from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.simulation.spines import random_rotation, random_spine

seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.sampled_from(["x", "y"]))
def test_triads_are_in_order_along_the_axis_around_the_centre(seed: int, axis: Literal["x", "y"]) -> None:
    poses = random_spine(np.random.default_rng(seed), 5, axis=axis, centre_mm=(10.0, 20.0, 30.0))
    positions = np.array([pose.position_mm for pose in poses])
    along = "xy".index(axis)
    assert np.all(np.diff(positions[:, along]) > 0)
    assert positions[:, along].mean() == pytest.approx((10, 20)[along])
    assert np.abs(positions[:, 2] - 30).max() < 5 + 6 * 2
    assert all(not pose.covariance.any() for pose in poses)


def test_distances_follow_the_steps() -> None:
    rng = np.random.default_rng(0)
    gaps = [
        np.diff([pose.position_mm[0] for pose in random_spine(rng, 4, spacing_mm=40, steps=(1, 2, 1))])
        for _ in range(200)
    ]
    assert np.mean(gaps, axis=0) == pytest.approx([40, 80, 40], rel=0.03)
    assert np.std(gaps, axis=0) == pytest.approx([4, 8, 4], rel=0.2)


@pytest.mark.parametrize("bend", [0.0, 30.0])
def test_the_direction_of_the_chain_changes_by_the_bend(bend: float) -> None:
    rng = np.random.default_rng(0)
    changes = []
    for _ in range(300):
        p = np.array([pose.position_mm for pose in random_spine(rng, 9, bend_deg=bend)])
        first, last = p[1] - p[0], p[-1] - p[-2]
        changes.append(np.degrees(np.arctan2(last[1], last[0]) - np.arctan2(first[1], first[0])))
    assert np.mean(changes) == pytest.approx(bend * 7 / 8, abs=2)


@given(seeds, st.floats(0, 40))
def test_rotations_are_proper(seed: int, tilt: float) -> None:
    R = random_rotation(np.random.default_rng(seed), tilt)
    assert np.allclose(R @ R.T, np.eye(3))
    assert np.linalg.det(R) == pytest.approx(1)


def test_normals_tilt_by_the_standard_deviation() -> None:
    rng = np.random.default_rng(0)
    normals = np.array([random_rotation(rng, 5.0)[:, 2] for _ in range(2000)])
    assert np.degrees(np.arcsin(normals[:, :2].std(axis=0))) == pytest.approx([5, 5], rel=0.05)
    axes = np.array([random_rotation(rng, 0.0)[:, 0] for _ in range(2000)])
    assert np.abs(axes.mean(axis=0)).max() < 0.06  # azimuths are uniform
