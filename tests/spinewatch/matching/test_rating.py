from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.identification import IdentificationParameters, identify_triads
from spinewatch.matching.points import MatchingParameters, match_features
from spinewatch.matching.rating import (
    likeliest_points,
    point_log_odds,
    rate_candidates,
    score_log_odds,
    tilt_log_odds,
)
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine

RIG, PARAMETERS = large_rig(), SelectionParameters()


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_log_odds_of_a_tilt_are_a_density_ratio(seed: int) -> None:
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    tilt = np.radians(rng.uniform(0, 60))
    towards = (RIG.left.centre + RIG.right.centre) / 2 - [430.0, 390, 90]
    towards = towards / np.linalg.norm(towards)
    axis = np.cross(towards, direction)
    R = rotation_from_vector(tilt * axis / np.linalg.norm(axis))
    frame = np.column_stack([np.zeros(3), np.zeros(3), R @ towards])
    facing, log_odds = tilt_log_odds(np.array([[430.0, 390, 90]]), frame[None], RIG, PARAMETERS)
    sd = np.radians(PARAMETERS.tilt_sd_deg)
    normal = np.exp(-0.5 * (tilt / sd) ** 2) / (2 * np.pi * sd**2)
    assert np.exp(log_odds[0]) == pytest.approx(normal / (1 / (4 * np.pi)), rel=1e-6)
    assert facing[0]


def test_a_marker_that_faces_away_is_no_candidate() -> None:
    away = np.diag([1.0, -1, -1])
    facing, _ = tilt_log_odds(np.full((1, 3), 400.0), away[None], RIG, PARAMETERS)
    assert not facing[0]


def test_scores_above_the_mean_raise_the_log_odds_of_a_ball() -> None:
    low, high = score_log_odds(np.array([0.2, 0.8]), PARAMETERS)
    assert low < 0 < high
    assert score_log_odds(np.ones(3), PARAMETERS).tolist() == pytest.approx([-0.245] * 3)
    assert len(score_log_odds(np.empty(0), PARAMETERS)) == 0


def test_the_likeliest_points_are_those_of_the_largest_log_odds_in_their_order() -> None:
    rng = np.random.default_rng(5)
    seen = observe(large_rig(), random_spine(rng, 4), rng, FeatureNoise(0.1, false_features=20))
    points = match_features(seen.left, seen.right, large_rig(), 8.0, MatchingParameters())
    p = SelectionParameters()
    few = likeliest_points(points, p, 10)
    left_out = np.sort(point_log_odds(points, p))[: len(points) - 10]
    assert len(few) == 10
    at = [int(np.flatnonzero((points.position_mm == one).all(axis=1))[0]) for one in few.position_mm]
    assert at == sorted(at)
    assert point_log_odds(points, p)[at].min() >= left_out.max()
    assert likeliest_points(points, p, len(points)) is points


def test_true_triads_are_the_most_likely_candidates() -> None:
    rng = np.random.default_rng(3)
    poses = random_spine(rng, 4)
    observed = observe(RIG, poses, rng, FeatureNoise(0.1, false_features=40))
    found = match_features(observed.left, observed.right, RIG, 8.0, MatchingParameters())
    triplets = identify_triads(found, FLAT_10_14_18, IdentificationParameters())
    rated = rate_candidates([triplets], found, [FLAT_10_14_18], RIG, PARAMETERS, 4)
    distance = np.linalg.norm(rated.origin_mm[:4, None] - np.array([p.position_mm for p in poses]), axis=-1)
    assert np.all(distance.min(axis=0) < 1)
    assert np.all(np.diff(rated.log_odds) <= 0)
    fewer = rate_candidates([triplets], found, [FLAT_10_14_18], RIG, replace(PARAMETERS, max_candidates=2), 4)
    assert len(fewer) == 2


def test_the_prior_odds_are_the_expected_number_or_the_assumed_one() -> None:
    rng = np.random.default_rng(3)
    observed = observe(RIG, random_spine(rng, 4), rng, FeatureNoise(0.1))
    found = match_features(observed.left, observed.right, RIG, 8.0, MatchingParameters())
    triplets = identify_triads(found, FLAT_10_14_18, IdentificationParameters())
    ten, unknown = (
        rate_candidates([triplets], found, [FLAT_10_14_18], RIG, PARAMETERS, count) for count in (10, None)
    )
    assert ten.log_odds[0] - unknown.log_odds[0] == pytest.approx(np.log(10 / PARAMETERS.assumed_count))
