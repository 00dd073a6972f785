from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.detection.features import HIDDEN
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.identification import IdentificationParameters, identify_triads
from spinewatch.matching.points import MatchingParameters, Points, match_features
from spinewatch.matching.selection import (
    SelectionParameters,
    TriadCandidates,
    likeliest_points,
    pad_features,
    point_log_odds,
    rate_candidates,
    score_log_odds,
    select_triads,
    share_features,
    tilt_log_odds,
)
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine

RIG, PARAMETERS = large_rig(), SelectionParameters()


def candidates(origin: Float, log_odds: Float, features: list[list[int]]) -> TriadCandidates:
    n = len(origin)
    index = pad_features(np.array(features))
    return TriadCandidates(
        np.zeros(n, dtype=int), np.array(origin), np.tile(np.eye(3), (n, 1, 1)), log_odds, index, index
    )


def chain_of(n: int, log_odds: float = 12.0, axis: int = 0) -> TriadCandidates:
    origin = 50.0 * np.arange(n)[:, None] * np.eye(3)[axis]
    return candidates(origin, np.full(n, log_odds), [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(n)])


def points(n: int = 2) -> Points:
    corners = np.linspace(0, 300, n)[:, None] * np.ones(3)
    nothing, index = np.zeros(n), np.arange(n)
    return Points(corners, np.tile(np.eye(3), (n, 1, 1)), index, index, nothing, nothing, nothing, nothing)


@pytest.mark.parametrize("axis", ["x", "y", "auto"])
def test_a_chain_is_selected_in_order_along_the_axis(axis: str) -> None:
    along = "y" if axis == "auto" else axis
    found = chain_of(4, axis="xy".index(along)).take([2, 0, 3, 1])
    selected = select_triads(found, points(), PARAMETERS, axis=axis)  # type: ignore[arg-type]
    assert selected.tolist() == [1, 3, 0, 2]


def test_never_more_than_expected_or_than_the_largest_number() -> None:
    assert len(select_triads(chain_of(6), points(), PARAMETERS, expected=3, axis="x")) == 3
    few = replace(PARAMETERS, max_count=2)
    assert len(select_triads(chain_of(6), points(), few, axis="x")) == 2
    assert len(select_triads(TriadCandidates.empty(), points(), PARAMETERS)) == 0


def test_of_two_triads_with_the_same_feature_the_more_likely_chain_is_selected() -> None:
    origin = np.array([[0.0, 0, 0], [50, 0, 0], [75, 0, 0], [100, 0, 0]])
    found = candidates(origin, np.array([12.0, 12, 11, 12]), [[0, 1, 2], [3, 4, 5], [5, 6, 7], [8, 9, 10]])
    assert select_triads(found, points(), PARAMETERS, axis="x").tolist() == [0, 1, 3]


def test_hidden_balls_are_not_shared() -> None:
    found = candidates(np.zeros((3, 3)), np.zeros(3), [[0, 1, HIDDEN], [2, 3, HIDDEN], [4, 3, 5]])
    assert share_features(found).tolist() == [
        [True, False, False],
        [False, True, True],
        [False, True, True],
    ]


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
