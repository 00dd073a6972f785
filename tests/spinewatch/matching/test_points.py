import numpy as np

from spinewatch.detection.features import Features
from spinewatch.matching.points import MatcherParameters, match_features
from spinewatch.simulation.observations import Noise, ball_centres, observe
from spinewatch.simulation.rigs import table_3_3_rig
from spinewatch.simulation.spines import random_spine


def test_every_ball_is_among_the_points_with_an_honest_covariance() -> None:
    rng = np.random.default_rng(2)
    rig, poses = table_3_3_rig(), random_spine(rng)
    seen = observe(rig, poses, rng, Noise(0.3, false_features=60))
    points = match_features(seen.left, seen.right, rig, MatcherParameters(extra_sd_mrad=0.0))
    left, right = seen.left_ball[points.left_index], seen.right_ball[points.right_index]
    true = (left >= 0) & (left == right)
    assert set(left[true]) == set(range(12))
    miss = points.position_mm[true] - ball_centres(poses).reshape(-1, 3)[left[true]]
    S = np.linalg.inv(points.covariance_mm2[true])
    assert np.einsum("ni,nij,nj->n", miss, S, miss).max() < 21  # 3 degrees of freedom, one in ten thousand
    assert len(points) > 12  # one feature, many points


def test_no_features_give_no_points() -> None:
    rig = table_3_3_rig()
    assert len(match_features(Features.empty(), Features.empty(), rig, MatcherParameters())) == 0
