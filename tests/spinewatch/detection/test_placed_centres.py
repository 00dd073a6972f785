"""Centres that a person placed beside detected features."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.detection.features import Features
from spinewatch.detection.placed_centres import compared, like_balls, not_used, placed_covariances
from spinewatch.detection.refinement.centre_parameters import CentreParameters

P = CentreParameters()
RADIUS = np.array([5.0, 6.0])
BALLS = np.array([[100.0, 100.0], [140.0, 100.0], [110.0, 130.0]])


def detected(centres: Float = BALLS, score: float = 0.9) -> Features:
    return Features.with_sigma(centres, np.full(len(centres), score), 0.1)


def test_features_of_low_score_are_not_like_balls() -> None:
    assert len(like_balls(detected(score=P.placed.min_score), P)) == 3
    assert len(like_balls(detected(score=P.placed.min_score - 0.01), P)) == 0


def test_features_of_balls_that_are_used_are_left_out() -> None:
    free = not_used(detected(), BALLS[:1] + np.array([1.0, 0.0]), RADIUS, P.merge_radius)
    np.testing.assert_array_equal(free.xy_px, BALLS[1:])


def test_a_centre_beside_a_ball_is_as_uncertain_as_it_is_far() -> None:
    near, far, alone = placed_covariances(
        BALLS[[0, 1, 2]] + np.array([[1.0, 0], [8.0, 0], [0, 60.0]]), detected(), RADIUS, P
    )
    hand = P.manual_sd * RADIUS
    np.testing.assert_allclose(np.sqrt(np.diag(near)), hand)
    np.testing.assert_allclose(np.sqrt(np.diag(far)), [np.hypot(hand[0], 8.0), hand[1]])
    np.testing.assert_allclose(np.sqrt(np.diag(alone)), P.placed.unconfirmed_sd * RADIUS)


def test_the_mean_of_centres_that_nothing_confirms_is_as_uncertain_as_one() -> None:
    placed = BALLS + 200
    one, three = (
        placed_covariances(placed[:1], detected(), RADIUS, P),
        placed_covariances(placed, detected(), RADIUS, P),
    )
    np.testing.assert_allclose(three.sum(axis=0) / 9, one[0])


@given(st.floats(-25, 25), st.floats(-25, 25))
def test_a_common_displacement_is_found_from_the_shape(u: float, v: float) -> None:
    centres, together = compared(BALLS + np.array([u, v]), detected(), RADIUS, P)
    for centre in centres:
        assert centre.distance_px == pytest.approx(np.hypot(u, v), abs=1e-9)
    shift_sd = np.hypot(*(np.array([u, v]) / np.hypot(P.manual_sd * RADIUS, 0.1))) * np.sqrt(3)
    if abs(shift_sd - P.placed.max_sd) > 1e-6:
        assert together == (shift_sd > P.placed.max_sd)


def test_a_single_centre_is_compared_with_the_nearest_feature_within_reach() -> None:
    (beside,), together = compared(np.array([[108.0, 100.0]]), detected(), RADIUS, P)
    assert (beside.feature_px, beside.distance_px, together) == ((100.0, 100.0), 8.0, False)
    assert beside.distance_sd == pytest.approx(8 / np.hypot(0.6, 0.1))
    (alone,), _ = compared(np.array([[120.0, 100.0]]), detected(), RADIUS, P)
    assert (alone.feature_px, alone.distance_px, alone.distance_sd) == (None, None, None)


def test_without_features_nothing_is_compared() -> None:
    centres, together = compared(BALLS, Features.empty(), RADIUS, P)
    assert [centre.distance_px for centre in centres] == [None] * 3
    assert not together
