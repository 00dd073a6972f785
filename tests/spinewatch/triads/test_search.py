import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.markers import FLAT_10_14_18, TriadModel, flat_triad, orthogonal_triad
from spinewatch.matching.chain import ChainParameters
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig, random_rig, small_rig, table_3_3_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.occlusion import OcclusionParameters
from spinewatch.triads.pose import Pose
from spinewatch.triads.search import (
    SearchParameters,
    TriadSearch,
    ball_images,
    full_view_chain,
    full_view_points,
    match_triads,
)

PARAMETERS = SearchParameters()
BODY = TriadModel(
    "body", ("A", "B", "C", "D"), np.array([[18.0, 0, 0], [0, -15, 0], [-13, 0, 0], [-4, 18, 8]]), 8.0
)


def distances(search: TriadSearch, poses: Sequence[Pose]) -> Float:
    found = np.array([t.position_mm for t in search.triads]).reshape(-1, 3)
    return np.asarray(np.linalg.norm(found[:, None] - [p.position_mm for p in poses], axis=-1))


def test_of_too_many_points_the_most_likely_are_used() -> None:
    rng, rig = np.random.default_rng(3), large_rig()
    poses = random_spine(rng, 4)
    observed = observe(rig, poses, rng, FeatureNoise(0.1, false_features=80))
    every = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=4)
    few = match_triads(observed.left, observed.right, rig, replace(PARAMETERS, max_points=40), expected=4)
    assert len(every.points) > len(few.points) == 40
    pairs = [set(zip(one.points.left_index, one.points.right_index, strict=True)) for one in (every, few)]
    assert pairs[1] < pairs[0]
    assert (distances(few, poses) < 2.5).any(axis=0).sum() >= 3


@pytest.mark.parametrize("rig", [small_rig(), large_rig(), table_3_3_rig()], ids=lambda r: r.name)
@pytest.mark.parametrize("axis", ["x", "y"])
def test_every_triad_and_no_other_among_many_false_features(rig: Rig, axis: Any) -> None:
    found = false = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        poses = random_spine(rng, 4, axis=axis)
        observed = observe(rig, poses, rng, FeatureNoise(0.25, false_features=80))
        search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=4, axis=axis)
        near = distances(search, poses) < 2.5
        found += near.any(axis=0).sum()
        false += (~near.any(axis=1)).sum()
    assert found >= 46
    assert false <= 1


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_exact_features_give_the_exact_triads(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = random_rig(rng)
    poses = random_spine(rng, 3)
    observed = observe(rig, poses, rng, FeatureNoise(0.0))
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=3, axis="x")
    assert len(search.triads) == 3
    assert search.flags == ()
    for triad, truth in zip(search.triads, poses, strict=True):
        assert triad.pose is not None
        assert np.allclose(triad.pose.position_mm, truth.position_mm, atol=1e-4)
        assert np.linalg.norm(vector_from_rotation(triad.pose.rotation @ truth.rotation.T)) < 1e-5
        assert triad.error_mm < 1e-4
        assert list(triad.balls) == ["XX", "YY", "MX"]


def test_a_missing_triad_is_flagged() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(4)
    poses = random_spine(rng, 4)
    observed = observe(rig, poses, rng, FeatureNoise(0.2, false_features=60), dropped=[4, 5])
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=4, axis="x")
    assert [flag.code for flag in search.flags] == ["triad-count-low"]
    assert len(search.triads) == 3
    assert (distances(search, poses).min(axis=1) < 2.5).all()


@pytest.mark.parametrize("expected", [1, 3, 4, None])
def test_all_triads_in_view_are_found_whatever_number_is_expected(expected: int | None) -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(5)
    poses = random_spine(rng, 5, spacing_mm=45.0)
    observed = observe(rig, poses, rng, FeatureNoise(0.1, false_features=30))
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=expected)
    assert len(search.triads) == 5
    assert [flag.code for flag in search.flags] == ([] if expected is None else ["triad-count-high"])


def test_false_features_are_no_triads_beyond_the_expected_number() -> None:
    for seed in range(15):
        rng = np.random.default_rng([7, seed])
        poses = random_spine(rng, 4, spacing_mm=45.0)
        observed = observe(large_rig(), poses, rng, FeatureNoise(0.25, false_features=80))
        search = match_triads(observed.left, observed.right, large_rig(), PARAMETERS, expected=4)
        assert len(search.triads) <= 4


def test_a_triad_that_faces_away_is_not_found() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(6)
    front = random_spine(rng, 1)[0]
    back = Pose(front.position_mm, front.rotation * [1.0, -1.0, -1.0], front.covariance)
    for pose, count in ((front, 1), (back, 0)):
        observed = observe(rig, [pose], rng, FeatureNoise(0.05))
        assert len(match_triads(observed.left, observed.right, rig, PARAMETERS, expected=1).triads) == count


def test_false_features_alone_rarely_make_a_triad() -> None:
    rig, triads = table_3_3_rig(), 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        empty = observe(
            rig, random_spine(rng, 4), rng, FeatureNoise(0.3, false_features=100), dropped=range(12)
        )
        triads += len(match_triads(empty.left, empty.right, rig, PARAMETERS, expected=4).triads)
    assert triads <= 2


def test_no_features_no_triads() -> None:
    search = match_triads(Features.empty(), Features.empty(), table_3_3_rig(), PARAMETERS, expected=4)
    assert search.triads == ()
    assert [flag.code for flag in search.flags] == ["triad-count-low"]


def test_the_same_features_give_the_same_bits() -> None:
    rig, rng = small_rig(), np.random.default_rng(8)
    observed = observe(rig, random_spine(rng), rng, FeatureNoise(0.3, false_features=50))
    first, second = (
        match_triads(observed.left, observed.right, rig, PARAMETERS, expected=4) for _ in range(2)
    )
    assert len(first.triads) == 4
    for a, b in zip(first.triads, second.triads, strict=True):
        assert a.pose is not None
        assert b.pose is not None
        assert np.array_equal(a.pose.position_mm, b.pose.position_mm)
        assert np.array_equal(a.pose.covariance, b.pose.covariance)


def test_a_stricter_selection_keeps_fewer() -> None:
    rig, rng = small_rig(), np.random.default_rng(9)
    observed = observe(rig, random_spine(rng), rng, FeatureNoise(0.3, false_features=50))
    strict = replace(PARAMETERS, selection=SelectionParameters(chain=ChainParameters(min_log_odds=50.0)))
    assert len(match_triads(observed.left, observed.right, rig, PARAMETERS, expected=4).triads) == 4
    assert len(match_triads(observed.left, observed.right, rig, strict, expected=4).triads) == 0


@pytest.mark.parametrize("seed", range(6))
def test_irregular_and_bent_chains_of_unknown_length(seed: int) -> None:
    rig, rng = large_rig(), np.random.default_rng(seed)
    poses = random_spine(rng, 5, spacing_mm=30, steps=(1, 3, 2, 1), bend_deg=90)
    observed = observe(rig, poses, rng, FeatureNoise(0.1, false_features=30))
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, axis="x")
    assert len(search.triads) == 5
    assert (distances(search, poses).min(axis=1) < 1).all()


def test_several_markers_in_one_surgery_keep_their_names() -> None:
    rig, rng = large_rig(), np.random.default_rng(7)
    models = (FLAT_10_14_18, flat_triad(24, 16, 8), orthogonal_triad(26, 20, 14), BODY)
    poses = random_spine(rng, 4, spacing_mm=60)
    observed = observe(rig, poses, rng, FeatureNoise(0.1, false_features=30), models=models)
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=4, axis="x", models=models)
    assert [triad.model for triad in search.triads] == [model.name for model in models]
    assert (distances(search, poses).min(axis=1) < 1).all()
    assert list(search.triads[3].balls) == ["A", "B", "C", "D"]


def test_the_mirror_image_of_a_body_of_four_balls_is_not_the_body() -> None:
    rig, rng = large_rig(), np.random.default_rng(9)
    mirrored = TriadModel("mirrored", BODY.balls, BODY.coordinates_mm * [1, 1, -1], 8.0)
    poses = random_spine(rng, 2)
    observed = observe(rig, poses, rng, FeatureNoise(0.05), models=[mirrored] * 2)
    whole = replace(PARAMETERS, occlusion=OcclusionParameters(enabled=False))
    for model, count in ((mirrored, 2), (BODY, 0)):
        found = match_triads(observed.left, observed.right, rig, whole, expected=2, models=[model])
        assert len(found.triads) == count


def test_the_ball_images_are_those_of_the_balls_in_full_view() -> None:
    rig, rng = large_rig(), np.random.default_rng(12)
    poses = random_spine(rng, 3)
    observed = observe(rig, poses, rng, FeatureNoise(0.1, false_features=20), hidden=[(4, "right")])
    search = match_triads(observed.left, observed.right, rig, PARAMETERS, expected=3, axis="x")
    left, right = ball_images(search, observed.left, observed.right)
    assert len(left) == len(right) == 8
    balls = [ball for triad in search.triads for ball in triad.balls.values() if not ball.hidden_in]
    assert {tuple(xy) for xy in left.xy_px} == {
        tuple(ball.left_px) for ball in balls if ball.left_px is not None
    }


def test_the_parameters_are_plain_values() -> None:
    document = asdict(PARAMETERS)
    assert json.loads(json.dumps(document))["occlusion"]["adjustment"]["max_steps"] == 5


def test_the_chain_in_full_view_is_that_of_the_marker_in_use() -> None:
    rng, rig, p = np.random.default_rng(4), large_rig(), SearchParameters()
    seen = observe(rig, random_spine(rng, 4), rng, FeatureNoise(0.1, false_features=10))
    points = full_view_points((seen.left, seen.right), rig, [FLAT_10_14_18], p)
    count, log_odds = full_view_chain(points, rig, [FLAT_10_14_18], p, expected=4)
    other_count, other_log_odds = full_view_chain(points, rig, [flat_triad(30.0, 22.0, 16.0)], p, expected=4)
    assert count == 4
    assert other_count < 4
    assert other_log_odds < log_odds
