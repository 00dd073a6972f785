"""Where the images of missing balls may be."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.epipolar import EpipolarParameters, nominal_ranges_mm
from spinewatch.simulation.observations import FeatureNoise, HiddenBall, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import DOUBTFUL, ball_centres
from spinewatch.triads.search import SearchParameters, match_triads
from spinewatch.triads.second_look import SecondLookParameters, missing_ball_places

RIG = large_rig()
RANGES_MM = nominal_ranges_mm(RIG, EpipolarParameters())
CAPTURE_PX = 3.5
"""From this distance the networks find a ball of 10 px."""


def places(
    expected: int | None, hidden: Collection[HiddenBall] = (), dropped: Collection[int] = ()
) -> tuple[tuple[Float, Float] | None, Float]:
    """Return the places for a spine of three triads, and its ball centres (9, 2, 2), px."""
    rng = np.random.default_rng(5)
    spine = random_spine(rng, 3)
    seen = observe(RIG, spine, rng, FeatureNoise(0.1), hidden=hidden, dropped=dropped)
    search = match_triads(seen.left, seen.right, RIG, SearchParameters(), expected=expected, axis="x")
    found = missing_ball_places(
        search, seen.left, seen.right, RIG, RANGES_MM, [FLAT_10_14_18], SecondLookParameters(), expected
    )
    balls = ball_centres(spine, FLAT_10_14_18).reshape(-1, 3)
    return found, np.stack([RIG.left.project(balls), RIG.right.project(balls)], axis=1)


def gap(found: tuple[Float, Float] | None, side: int, centre: Float) -> float:
    assert found is not None
    return float(np.linalg.norm(found[side] - centre, axis=1).min())


@pytest.mark.parametrize("expected", [None, 3])
def test_nothing_is_examined_when_no_ball_is_missing(expected: int | None) -> None:
    assert places(expected)[0] is None


def test_a_hidden_ball_is_sought_where_the_pose_says() -> None:
    for expected in (None, 3):
        found, centres = places(expected, hidden=[(4, "right")])
        assert gap(found, 1, centres[4, 1]) < CAPTURE_PX


def test_a_ball_of_one_view_is_sought_on_its_epipolar_line() -> None:
    found, centres = places(3, hidden=[(3, "right"), (4, "left"), (5, "right")])
    assert gap(found, 1, centres[3, 1]) < CAPTURE_PX
    assert gap(found, 0, centres[4, 0]) < CAPTURE_PX


def test_the_third_ball_is_sought_about_the_other_two() -> None:
    found, centres = places(3, dropped=[4])
    for side in (0, 1):
        assert gap(found, side, centres[4, side]) < CAPTURE_PX


def test_each_ball_of_a_doubtful_triad_is_sought_about_the_other_two() -> None:
    rng = np.random.default_rng(5)
    spine = random_spine(rng, 3)
    seen = observe(RIG, spine, rng, FeatureNoise(0.1))
    search = match_triads(seen.left, seen.right, RIG, SearchParameters(), expected=3, axis="x")
    doubtful = replace(search.triads[1], pose=None, reason=DOUBTFUL, doubtful=True)
    search = replace(search, triads=(search.triads[0], doubtful, search.triads[2]))
    few = SecondLookParameters(features_per_triad=0)
    found = missing_ball_places(search, seen.left, seen.right, RIG, RANGES_MM, [FLAT_10_14_18], few, 3)
    for ball in ball_centres(spine, FLAT_10_14_18).reshape(-1, 3)[3:6]:
        for side, camera in enumerate((RIG.left, RIG.right)):
            assert gap(found, side, camera.project(ball)) < CAPTURE_PX


def test_without_any_triad_the_epipolar_lines_are_examined() -> None:
    found, centres = places(3, hidden=[(b, "right") for b in range(9) if b % 3])
    assert gap(found, 1, centres[1, 1]) < CAPTURE_PX


def test_places_are_within_the_images_and_apart() -> None:
    found, _ = places(3, hidden=[(3, "right"), (4, "left"), (5, "right")])
    assert found is not None
    for of_side in found:
        assert np.all((of_side >= 0) & (of_side <= (567, 415)))
        assert len(np.unique(np.round(of_side / 0.5), axis=0)) == len(of_side)
