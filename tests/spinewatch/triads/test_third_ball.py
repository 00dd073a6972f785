import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.rays import Rays
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import ball_centres
from spinewatch.triads.third_ball import Circles, features_near_circles, frames_near_z, third_ball_circles

CAMERA = large_rig().left
PAIRS = [(0, 1), (1, 0), (0, 2), (1, 2)]


def triads(count: int, seed: int = 0) -> Float:
    """Balls of triads, (n, 3, 3)."""
    return ball_centres(random_spine(np.random.default_rng(seed), count), FLAT_10_14_18).reshape(-1, 3, 3)


def circles_of(balls_mm: Float, balls: tuple[int, int], n_points: int = 24) -> Circles:
    a, b = balls
    return third_ball_circles(balls_mm[:, a], balls_mm[:, b], FLAT_10_14_18, balls, n_points)


def rays(pixels: Float) -> Rays:
    return CAMERA.rays(pixels, 0.1**2 * np.eye(2))


@pytest.mark.parametrize("balls", PAIRS)
def test_the_points_of_a_circle_are_at_the_markers_distances_from_both_balls(balls: tuple[int, int]) -> None:
    seen, third = triads(4), 3 - sum(balls)
    points = circles_of(seen, balls).points_mm
    assert points.shape == (4, 3, 24)
    for ball in balls:
        true = np.linalg.norm(seen[:, third] - seen[:, ball], axis=1)
        assert np.linalg.norm(points - seen[:, ball, :, None], axis=1) == pytest.approx(
            np.tile(true[:, None], 24)
        )


@pytest.mark.parametrize("balls", PAIRS)
def test_the_line_of_sight_of_the_third_ball_meets_the_circle_there(balls: tuple[int, int]) -> None:
    seen, third = triads(4), 3 - sum(balls)
    circles = circles_of(seen, balls, 360)
    sight = rays(CAMERA.project(seen[:, third]))
    near = features_near_circles(circles, sight, np.arange(4), 4.0)
    assert {(k, k) for k in range(4)} <= set(zip(near.circle.tolist(), near.feature.tolist(), strict=True))
    ends = circles.along_sight(near.circle, near.point, sight.vectors[near.feature], 0.0)
    gaps = [np.linalg.norm(end - seen[near.feature, third], axis=1) for end in ends]
    assert np.minimum(*gaps)[near.circle == near.feature].max() < 1.0


def test_where_the_line_of_sight_touches_the_circle_the_two_positions_are_apart() -> None:
    circle = Circles(np.zeros((1, 3)), np.array([[0.0, 0, 1]]), np.array([[1.0, 0, 0]]), 10.0, 4)
    one = np.zeros(1, dtype=np.intp)
    near, far = circle.along_sight(one, one, np.array([[0.0, 1, 0]]), 0.2)
    assert near[0, 1] < 0 < far[0, 1]
    assert np.linalg.norm(far - near) == pytest.approx(2 * 10 * 0.2 / np.hypot(1, 0.2))
    assert np.linalg.norm([near, far], axis=-1) == pytest.approx(np.full((2, 1), 10))


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_features_near_a_circle_are_those_within_the_distance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    circles = circles_of(triads(3, seed), (0, 1))
    features = rays(rng.uniform((0, 0), CAMERA.image_size_px, (200, 2)))
    free = np.flatnonzero(rng.random(200) < 0.7)
    near = features_near_circles(circles, features, free, 4.0)
    images = features.pinhole.project(np.swapaxes(circles.points_mm, 1, 2))[0]
    gap = np.linalg.norm(images[:, None] - features.ideal_mm[free][None, :, None], axis=-1)
    circle, feature = np.nonzero(gap.min(axis=2) <= features.pinhole.focal_length_mm * 4.0 / 1000)
    assert near.circle.tolist() == circle.tolist()
    assert near.feature.tolist() == free[feature].tolist()
    assert near.distance_mm == pytest.approx(gap.min(axis=2)[circle, feature])


def test_without_free_features_none_is_near() -> None:
    features = rays(np.full((1, 2), 100.0))
    near = features_near_circles(circles_of(triads(1), (0, 1)), features, np.empty(0, dtype=np.intp), 4.0)
    assert len(near.circle) == len(near.feature) == len(near.point) == len(near.distance_mm) == 0


def test_the_z_axis_of_a_frame_is_as_near_to_z_as_its_x_axis_permits() -> None:
    x = np.random.default_rng(3).normal(size=(20, 3))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frames = frames_near_z(x)
    assert frames[:, :, 0] == pytest.approx(x)
    assert frames @ np.swapaxes(frames, 1, 2) == pytest.approx(np.tile(np.eye(3), (20, 1, 1)))
    assert np.linalg.det(frames) == pytest.approx(np.ones(20))
    assert frames[:, 2, 2] == pytest.approx(np.sqrt(1 - x[:, 2] ** 2))
