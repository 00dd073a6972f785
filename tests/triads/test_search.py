from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.camera import Float, Rig
from spinewatch.features import Features
from spinewatch.simulation.observations import observe
from spinewatch.simulation.rigs import large_rig, random_rig, small_rig, table_3_3_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.choose import ChooseParameters
from spinewatch.triads.pose import Pose, vector_from_rotation
from spinewatch.triads.search import SearchParameters, TriadSearch, match_triads

PARAMETERS = SearchParameters()


def distances(search: TriadSearch, poses: Sequence[Pose]) -> Float:
    found = np.array([t.pose.position_mm for t in search.triads]).reshape(-1, 3)
    return np.asarray(np.linalg.norm(found[:, None] - [p.position_mm for p in poses], axis=-1))


@pytest.mark.parametrize("rig", [small_rig(), large_rig(), table_3_3_rig()], ids=lambda r: r.name)
@pytest.mark.parametrize("axis", ["x", "y"])
def test_every_triad_and_no_other_among_many_false_features(rig: Rig, axis: Any) -> None:
    found = false = 0
    for seed in range(12):
        rng = np.random.default_rng(seed)
        poses = random_spine(rng, 4, axis=axis)
        seen = observe(rig, poses, rng, sigma_px=0.25, false_features=80)
        search = match_triads(seen.left, seen.right, rig, PARAMETERS, expected=4, axis=axis)
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
    seen = observe(rig, poses, rng, sigma_px=0.0)
    search = match_triads(seen.left, seen.right, rig, PARAMETERS, expected=3, axis="x")
    assert len(search.triads) == 3
    assert search.flags == ()
    for triad, truth in zip(search.triads, poses, strict=True):
        assert np.allclose(triad.pose.position_mm, truth.position_mm, atol=1e-4)
        assert np.linalg.norm(vector_from_rotation(triad.pose.rotation @ truth.rotation.T)) < 1e-5
        assert triad.error_mm < 1e-4
        assert list(triad.balls) == ["XX", "YY", "MX"]


def test_a_missing_triad_is_flagged_and_not_made_up() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(4)
    poses = random_spine(rng, 4)
    seen = observe(rig, poses, rng, sigma_px=0.2, false_features=60, dropped=[4, 5])
    search = match_triads(seen.left, seen.right, rig, PARAMETERS, expected=4, axis="x")
    assert [flag.code for flag in search.flags] == ["triad-count-low"]
    assert len(search.triads) == 3
    assert (distances(search, poses).min(axis=1) < 2.5).all()


def test_never_more_than_expected_and_all_without_a_number() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(5)
    poses = random_spine(rng, 5, spacing_mm=45.0)
    seen = observe(rig, poses, rng, sigma_px=0.1, false_features=30)
    assert len(match_triads(seen.left, seen.right, rig, PARAMETERS, expected=3).triads) == 3
    assert len(match_triads(seen.left, seen.right, rig, PARAMETERS).triads) == 5


def test_a_triad_that_turns_its_back_is_a_mirror_match() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(6)
    front = random_spine(rng, 1)[0]
    back = Pose(front.position_mm, front.rotation * [1.0, -1.0, -1.0], front.covariance)
    for pose, count in ((front, 1), (back, 0)):
        seen = observe(rig, [pose], rng, sigma_px=0.05)
        assert len(match_triads(seen.left, seen.right, rig, PARAMETERS, expected=1).triads) == count


def test_false_features_alone_rarely_make_a_triad() -> None:
    rig, triads = table_3_3_rig(), 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        empty = observe(rig, random_spine(rng, 4), rng, false_features=100, dropped=range(12))
        triads += len(match_triads(empty.left, empty.right, rig, PARAMETERS, expected=4).triads)
    assert triads <= 2


def test_no_features_no_triads() -> None:
    search = match_triads(Features.empty(), Features.empty(), table_3_3_rig(), PARAMETERS, expected=4)
    assert search.triads == ()
    assert [flag.code for flag in search.flags] == ["triad-count-low"]


def test_the_same_features_give_the_same_bits() -> None:
    rig, rng = small_rig(), np.random.default_rng(8)
    seen = observe(rig, random_spine(rng), rng, false_features=50)
    first, second = (match_triads(seen.left, seen.right, rig, PARAMETERS, expected=4) for _ in range(2))
    for a, b in zip(first.triads, second.triads, strict=True):
        assert np.array_equal(a.pose.position_mm, b.pose.position_mm)
        assert np.array_equal(a.pose.covariance, b.pose.covariance)


def test_a_stricter_choice_keeps_fewer() -> None:
    rig, rng = small_rig(), np.random.default_rng(9)
    seen = observe(rig, random_spine(rng), rng, sigma_px=0.3, false_features=50)
    strict = replace(PARAMETERS, choose=ChooseParameters(least_log_odds=50.0))
    assert len(match_triads(seen.left, seen.right, rig, strict, expected=4).triads) == 0


def test_an_error_that_the_balls_share_widens_the_position_only() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(10)
    seen = observe(rig, random_spine(rng, 1), rng, sigma_px=0.1)
    narrow, wide = (
        match_triads(seen.left, seen.right, rig, replace(PARAMETERS, common_sd_mrad=sd), expected=1)
        .triads[0]
        .pose
        for sd in (0.0, 0.13)
    )
    assert np.array_equal(narrow.position_mm, wide.position_mm)
    assert np.array_equal(narrow.covariance[3:], wide.covariance[3:])
    # Twin errors of 0.13 mrad at 0.7 m and 32 degrees of convergence are some 0.2 mm of height.
    assert 0.15 < np.sqrt(wide.covariance[2, 2] - narrow.covariance[2, 2]) < 0.3
