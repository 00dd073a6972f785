from dataclasses import replace

import numpy as np
import pytest

from spinewatch.detection.features import HIDDEN
from spinewatch.markers import FLAT_10_14_18, TriadModel, scaled
from spinewatch.matching.identification import chi2_limit
from spinewatch.matching.points import MatchingParameters, Points, match_features
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.ball_pairs import BallPairs, ball_pairs, pair_candidates

RIG, MODEL = large_rig(), FLAT_10_14_18


def points_of(model: TriadModel = MODEL) -> tuple[Points, list[int]]:
    """Points of one triad, and the ball of each; -1 for a false point."""
    rng = np.random.default_rng(7)
    seen = observe(RIG, random_spine(rng, 1), rng, FeatureNoise(0.05), models=[model])
    points = match_features(seen.left, seen.right, RIG, 8.0, MatchingParameters())
    left, right = seen.left_ball[points.left_index], seen.right_ball[points.right_index]
    return points, np.where(left == right, left, -1).tolist()


def pairs_of(points: Points, model_sd_mm: float = 0.2, significance: float = 0.001) -> list[BallPairs]:
    return ball_pairs(points, MODEL, 3.0, model_sd_mm, significance)


def test_the_balls_of_a_triad_are_pairs() -> None:
    points, balls = points_of()
    for found in pairs_of(points):
        true = [balls.index(ball) for ball in found.balls]
        assert true in found.point.tolist()
        A, B = MODEL.coordinates_mm[list(found.balls)]
        assert found.distance_mm == pytest.approx(np.linalg.norm(A - B))
        assert np.all(found.chi2 <= chi2_limit(1, 0.001))


def test_the_balls_of_a_marker_of_another_size_are_pairs_only_if_it_may_deviate() -> None:
    points, balls = points_of(scaled(MODEL, 1.08))
    exact, loose = (
        [
            [balls.index(ball) for ball in found.balls] in found.point.tolist()
            for found in pairs_of(points, sd)
        ]
        for sd in (0.2, 2.0)
    )
    assert not any(exact)
    assert any(loose)


def test_features_are_in_the_columns_of_the_two_balls() -> None:
    pairs = BallPairs((2, 0), 28.0, np.array([[0, 1], [1, 2]]), np.zeros(2))
    used = np.array([5, 6, 7])
    assert pairs.features(used, 4).tolist() == [[6, HIDDEN, 5, HIDDEN], [7, HIDDEN, 6, HIDDEN]]
    assert pairs.take([1]).features(used, 3).tolist() == [[7, HIDDEN, 6]]


def test_the_pose_of_a_candidate_has_its_two_balls_at_the_points() -> None:
    points, _ = points_of()
    pairs = pairs_of(points)
    found = pair_candidates(pairs, points, 5, MODEL, SelectionParameters(), 0.001)
    assert len(found) == sum(len(one.point) for one in pairs) > 0
    assert set(found.model.tolist()) == {5}
    assert np.all(((found.left != HIDDEN).sum(axis=1) == 2) & ((found.right != HIDDEN).sum(axis=1) == 2))
    used = zip(points.left_index.tolist(), points.right_index.tolist(), strict=True)
    position = dict(zip(used, points.position_mm, strict=True))
    poses = zip(found.origin_mm, found.rotation, found.left.tolist(), found.right.tolist(), strict=True)
    for origin, rotation, left, right in poses:
        for k, features in enumerate(zip(left, right, strict=True)):
            if HIDDEN not in features:
                ball = origin + rotation @ MODEL.coordinates_mm[k]
                assert ball == pytest.approx(position[features], abs=1.0)
        assert rotation @ rotation.T == pytest.approx(np.eye(3))
        assert rotation[2, 2] > 0.5


def test_both_orders_of_a_pair_are_equally_likely() -> None:
    points, _ = points_of()
    (one, *_) = pairs_of(points)
    other = replace(one, point=one.point[:, ::-1])
    first, second = (
        pair_candidates([pairs], points, 0, MODEL, SelectionParameters(), 0.001).log_odds
        for pairs in (one, other)
    )
    assert first.tolist() == second.tolist()
