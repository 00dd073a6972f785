from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.camera import Rig
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.identification import distance_errors
from spinewatch.simulation.observations import Noise, ball_centres, observe
from spinewatch.simulation.rigs import large_rig, random_rig, small_rig, table_3_3_rig
from spinewatch.simulation.spines import random_spine


@pytest.mark.parametrize(("rig", "baseline", "vergence"), [(small_rig(), 320, 24), (large_rig(), 420, 32)])
def test_configurations_have_their_geometry(rig: Rig, baseline: float, vergence: float) -> None:
    assert rig.baseline_mm == pytest.approx(baseline)
    assert rig.vergence_deg == pytest.approx(vergence)


@given(st.integers(0, 2**32 - 1))
def test_random_rigs_see_the_measuring_volume_and_keep_x_to_the_right(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed))
    corners = np.array([[x, y, z] for x in (384, 484) for y in (350, 430) for z in (60, 120)], dtype=float)
    for camera in (rig.left, rig.right):
        uv = camera.project(corners)
        assert np.all((uv >= 0) & (uv < camera.image_size_px))
        assert np.all(uv[4:, 0] > uv[:4, 0])


@given(st.integers(0, 2**32 - 1), st.sampled_from(["x", "y"]))
def test_spines_are_in_order_and_rigid(seed: int, axis: Any) -> None:
    poses = random_spine(np.random.default_rng(seed), 5, axis=axis)
    along = [p.position_mm["xy".index(axis)] for p in poses]
    assert along == sorted(along)
    assert np.allclose(distance_errors(ball_centres(poses), FLAT_10_14_18), 0, atol=1e-9)


def test_features_tell_their_ball() -> None:
    rng = np.random.default_rng(0)
    rig, poses = table_3_3_rig(), random_spine(rng)
    seen = observe(rig, poses, rng, Noise(0.2, false_features=20), dropped=[4])
    assert set(seen.left_ball) == set(range(12)) - {4} | {-1}
    assert (seen.right_ball == -1).sum() == 20
    balls = ball_centres(poses).reshape(-1, 3)
    true = seen.left_ball >= 0
    miss = seen.left.xy_px[true] - rig.left.project(balls[seen.left_ball[true]])
    assert 0.1 < miss.std() < 0.3
    assert np.all(np.diff(seen.left.score) <= 0)
