import numpy as np
import pytest

from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import table_3_3_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import ball_centres

FOUR = TriadModel(
    "four", ("A", "B", "C", "D"), np.array([[20.0, 0, 0], [0, -15, 0], [-12, 0, 0], [0, 4, 16]]), 8.0
)


def test_features_have_their_ball_and_their_noise() -> None:
    rng = np.random.default_rng(0)
    rig, poses = table_3_3_rig(), random_spine(rng)
    observation = observe(rig, poses, rng, FeatureNoise(0.2, false_features=20), dropped=[4])
    assert set(observation.left_ball) == set(range(12)) - {4} | {-1}
    assert (observation.right_ball == -1).sum() == 20
    balls = ball_centres(poses).reshape(-1, 3)
    true = observation.left_ball >= 0
    errors = observation.left.xy_px[true] - rig.left.project(balls[observation.left_ball[true]])
    assert 0.1 < errors.std() < 0.3
    assert np.all(np.diff(observation.left.score) <= 0)
    assert np.allclose(observation.left.covariance_px2, 0.2**2 * np.eye(2))


def test_a_hidden_ball_lacks_its_feature_in_one_view_only() -> None:
    rng = np.random.default_rng(0)
    observation = observe(
        table_3_3_rig(), random_spine(rng), rng, hidden=[(3, "left"), (7, "right"), (8, "right")]
    )
    assert set(observation.left_ball) == set(range(12)) - {3}
    assert set(observation.right_ball) == set(range(12)) - {7, 8}


def test_shared_pointing_errors_shift_the_balls_of_a_triad_alike() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(1)
    poses = random_spine(rng)
    observation = observe(rig, poses, rng, FeatureNoise(0.0, 1.0))
    balls = ball_centres(poses).reshape(-1, 3)
    errors = np.empty((12, 2))
    errors[observation.left_ball] = observation.left.xy_px - rig.left.project(balls[observation.left_ball])
    by_triad = errors.reshape(4, 3, 2)
    assert np.abs(by_triad - by_triad.mean(axis=1, keepdims=True)).max() < 1e-9
    assert by_triad.std() > 0.1


def test_features_outside_the_image_are_omitted() -> None:
    rng = np.random.default_rng(0)
    poses = random_spine(rng, 9, spacing_mm=80)
    observation = observe(table_3_3_rig(), poses, rng)
    assert 0 < len(observation.left) < 27
    assert np.all((observation.left.xy_px >= 0) & (observation.left.xy_px <= (567, 415)))


def test_markers_of_different_sizes_are_numbered_through() -> None:
    rng = np.random.default_rng(0)
    poses = random_spine(rng, 2)
    observation = observe(table_3_3_rig(), poses, rng, models=[FOUR, FLAT_10_14_18])
    assert set(observation.left_ball) == set(range(7))


def test_no_triads_give_false_features_only() -> None:
    observation = observe(table_3_3_rig(), [], np.random.default_rng(0), FeatureNoise(false_features=5))
    assert observation.left_ball.tolist() == [-1] * 5
    assert observation.left.score == pytest.approx(np.sort(observation.left.score)[::-1])
