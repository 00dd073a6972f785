from dataclasses import replace

import numpy as np
import pytest

from spinewatch.detection.features import Features
from spinewatch.matching.epipolar import EpipolarParameters
from spinewatch.matching.points import MatchingParameters, match_features
from spinewatch.matching.refinement import RefinementParameters
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import table_3_3_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import Pose, ball_centres

RIG = table_3_3_rig()


def observed(seed: int, sigma_px: float = 0.3, false: int = 60) -> tuple[Observation, tuple[Pose, ...]]:
    rng = np.random.default_rng(seed)
    poses = random_spine(rng)
    return observe(RIG, poses, rng, FeatureNoise(sigma_px, false_features=false)), poses


def test_every_ball_is_among_the_points_and_its_error_fits_the_covariance() -> None:
    features, poses = observed(2)
    parameters = MatchingParameters(extra_sd_mrad=0.0)
    points = match_features(features.left, features.right, RIG, 8.0, parameters)
    left, right = features.left_ball[points.left_index], features.right_ball[points.right_index]
    true = (left >= 0) & (left == right)
    assert set(left[true]) == set(range(12))
    error = points.position_mm[true] - ball_centres(poses).reshape(-1, 3)[left[true]]
    S = np.linalg.inv(points.covariance_mm2[true])
    assert np.einsum("ni,nij,nj->n", error, S, error).max() < 21  # 3 degrees of freedom, one in ten thousand
    assert len(points) > 12  # one feature, many points


def test_no_features_give_no_points() -> None:
    assert len(match_features(Features.empty(), Features.empty(), RIG, 8.0, MatchingParameters())) == 0


def test_the_log_odds_compare_a_normal_parallax_with_a_uniform_one_within_the_tolerance() -> None:
    features, _ = observed(3, false=20)
    parameters = MatchingParameters(epipolar=EpipolarParameters(tolerance_sigma=2.0))
    points = match_features(features.left, features.right, RIG, 8.0, parameters)
    normal = np.exp(-0.5 * points.chi2) / np.sqrt(2 * np.pi)
    assert np.allclose(np.exp(points.log_odds), normal / (1 / 4.0))
    assert np.sqrt(points.chi2.max()) < 2.1
    wider = replace(parameters, epipolar=EpipolarParameters(tolerance_sigma=4.0))
    assert len(match_features(features.left, features.right, RIG, 8.0, wider)) > len(points)


def test_the_score_of_a_point_is_the_lower_one_of_its_features() -> None:
    features, _ = observed(4)
    points = match_features(features.left, features.right, RIG, 8.0, MatchingParameters())
    scores = features.left.score[points.left_index], features.right.score[points.right_index]
    assert np.array_equal(points.score, np.minimum(*scores))
    few = points.take(points.score > np.median(points.score))
    assert 0 < len(few) < len(points)
    assert few.score.min() > np.median(points.score)


@pytest.mark.parametrize("diameter_mm", [8.0, 12.0])
def test_structural_refinement_uses_the_images_and_the_diameter_of_the_balls(diameter_mm: float) -> None:
    features, _ = observed(5)
    images = tuple(
        np.random.default_rng(side).integers(0, 255, (416, 568)).astype(np.uint8) for side in (0, 1)
    )
    parameters = MatchingParameters(refinement=RefinementParameters(enabled=True))
    left, right = features.left, features.right
    whole = match_features(left, right, RIG, diameter_mm, parameters)
    refined = match_features(left, right, RIG, diameter_mm, parameters, (images[0], images[1]))
    assert 0 < len(refined) < len(whole)
