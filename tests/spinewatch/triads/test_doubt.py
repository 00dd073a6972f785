"""The chance that a triad is false."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spinewatch.detection.features import Features
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.doubt import (
    DoubtParameters,
    TriadEvidence,
    without_doubtful_poses,
    without_unsupported_poses,
)
from spinewatch.triads.search import SearchParameters, TriadSearch, ball_images, match_triads

RIG = large_rig()


def refined(features: Features) -> Features:
    """Return features as the networks leave them."""
    return replace(features, visible=np.ones(len(features)))


def observed() -> Observation:
    rng = np.random.default_rng(3)
    return observe(RIG, random_spine(rng, 4), rng, FeatureNoise(0.05, false_features=10))


def search(left: Features, right: Features, parameters: SearchParameters | None = None) -> TriadSearch:
    return match_triads(left, right, RIG, parameters or SearchParameters(), expected=4, axis="x")


def with_unsure_ball(seen: Observation, ball: int) -> Features:
    """Return the left features with a displaced ball whose stated deviation is large."""
    left = refined(seen.left)
    index = int(np.flatnonzero(seen.left_ball == ball)[0])
    xy, covariance = left.xy_px.copy(), left.covariance_px2.copy()
    xy[index] += (2.0, 0.0)
    covariance[index] = 0.8**2 * np.eye(2)
    return replace(left, xy_px=xy, covariance_px2=covariance)


def test_each_observation_of_doubt_raises_the_chance() -> None:
    sound = np.array([15.0]), np.array([0.5]), np.array([0.3]), np.array([0.0])
    chance = TriadEvidence(*sound).chances(DoubtParameters())
    assert chance < 0.01
    for number, worse in enumerate((2.0, 3.5, 2.5, 1.5)):
        changed = [np.array([worse]) if k == number else value for k, value in enumerate(sound)]
        assert TriadEvidence(*changed).chances(DoubtParameters()) > 10 * chance


def test_sound_triads_keep_their_poses() -> None:
    seen = observed()
    found = search(refined(seen.left), refined(seen.right))
    assert [triad.doubtful for triad in found.triads] == [False] * 4
    assert found.flags == ()


def test_a_triad_with_an_unsure_ball_has_no_pose_and_stays_out_of_the_check_of_the_rig() -> None:
    seen = observed()
    left, right = with_unsure_ball(seen, 4), refined(seen.right)
    found = search(left, right)
    doubtful = [triad for triad in found.triads if triad.doubtful]
    assert len(doubtful) == 1
    assert doubtful[0].pose is None
    assert "the chance that it is at a wrong place or has a wrong ball is" in (doubtful[0].reason or "")
    assert [flag.code for flag in found.flags] == ["triad-doubtful", "triad-count-low"]
    assert len(ball_images(found, left, right)[0]) == 9


def test_a_ball_that_a_person_placed_is_beyond_doubt() -> None:
    seen = observed()
    left = with_unsure_ball(seen, 4)
    left = replace(left, manual=seen.left_ball == 4)
    found = search(left, refined(seen.right)).triads
    assert [triad.doubtful for triad in found] == [False] * 4


def test_features_that_no_network_refined_raise_no_doubt() -> None:
    seen = observed()
    none = SearchParameters(doubt=DoubtParameters(max_chance=0.0))
    found = search(seen.left, seen.right, none).triads
    assert [(triad.doubtful, triad.pose is None) for triad in found] == [(False, False)] * 4
    found = search(refined(seen.left), refined(seen.right), none).triads
    assert [triad.doubtful for triad in found] == [True] * 4


def test_no_triad_keeps_its_pose_when_most_are_doubtful() -> None:
    seen = observed()
    triads = search(refined(seen.left), refined(seen.right)).triads
    half = without_doubtful_poses(triads, [0.5, 0.5, 0.05, 0.01], 0.1)
    assert [t.doubtful for t in without_unsupported_poses(half)] == [True, True, False, False]
    most = without_unsupported_poses(without_doubtful_poses(triads, [0.5, 0.5, 0.05, 0.5], 0.1))
    assert [t.pose for t in most] == [None] * 4
    assert most[2].reason == "it is doubtful: so are 3 of the 3 others"
    assert [t.chance_false for t in most] == [0.5, 0.5, 0.05, 0.5]
