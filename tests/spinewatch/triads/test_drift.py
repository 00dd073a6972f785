from dataclasses import replace

import numpy as np

from spinewatch.camera import Rig
from spinewatch.matching.marker_scale import MarkerScale
from spinewatch.matching.rig_check import RigCheckParameters
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.drift import search_and_check_rig, series_flags
from spinewatch.triads.pose import Pose
from spinewatch.triads.search import SearchParameters, TriadSearch, match_triads

RIG = large_rig()
BUMPED = Rig("bumped", RIG.left, RIG.right.moved(np.radians([0.06, 0, 0]), np.zeros(3)))


class Search:
    """Search in the features of one pair; remembers the rigs that it was called with."""

    def __init__(self, observed: Observation, expected: int) -> None:
        self.observed, self.expected, self.rigs = observed, expected, list[Rig]()

    def __call__(self, rig: Rig) -> TriadSearch:
        self.rigs.append(rig)
        left, right = self.observed.left, self.observed.right
        return match_triads(left, right, rig, SearchParameters(), expected=self.expected, axis="x")


def observed(rig: Rig, triads: int = 5) -> tuple[Search, tuple[Pose, ...]]:
    rng = np.random.default_rng(1)
    poses = random_spine(rng, triads, spacing_mm=40)
    return Search(observe(rig, poses, rng, FeatureNoise(0.1, false_features=10)), triads), poses


def test_a_rig_without_drift_is_searched_once_and_not_flagged() -> None:
    search, _ = observed(RIG)
    left, right = search.observed.left, search.observed.right
    found, check, flags = search_and_check_rig(search, left, right, RIG, RigCheckParameters(refine=True))
    assert len(found.triads) == 5
    assert check is not None
    assert not check.drifted
    assert flags == ()
    assert search.rigs == [RIG]


def test_a_drift_is_flagged_and_left_alone_unless_refinement_is_on() -> None:
    search, _ = observed(BUMPED)
    left, right = search.observed.left, search.observed.right
    _, check, flags = search_and_check_rig(search, left, right, RIG, RigCheckParameters())
    assert check is not None
    assert check.drifted
    assert [flag.code for flag in flags] == ["calibration-drift"]
    assert flags[0].detail == check.message
    assert search.rigs == [RIG]


def test_markers_that_are_not_measured_in_their_size_are_a_drift_without_refinement() -> None:
    yawed = Rig("yawed", RIG.left, RIG.right.moved(np.radians([0, 0.5, 0]), np.zeros(3)))
    search, _ = observed(yawed)
    left, right = search.observed.left, search.observed.right
    _, check, flags = search_and_check_rig(search, left, right, RIG, RigCheckParameters(refine=True))
    assert [flag.code for flag in flags] == ["calibration-drift"]
    assert "of their size" in flags[0].detail
    assert check is not None
    assert check.marker_scale is not None
    assert check.marker_scale.distances == 15
    assert len(search.rigs) == 1  # the images do not determine how to correct it


def test_with_refinement_the_search_is_repeated_with_the_corrected_rig() -> None:
    search, _ = observed(BUMPED)
    left, right = search.observed.left, search.observed.right
    found, check, flags = search_and_check_rig(search, left, right, RIG, RigCheckParameters(refine=True))
    assert [flag.code for flag in flags] == ["calibration-drift", "rig-refined"]
    assert check is not None
    assert check.drifted  # the check is that of the given rig
    assert [rig.name for rig in search.rigs] == [RIG.name, f"{RIG.name} (refined)"]
    parallaxes = [
        np.mean([ball.parallax_mm or 0.0 for triad in result.triads for ball in triad.balls.values()])
        for result in (search(RIG), found)
    ]
    assert parallaxes[1] < 0.5 * parallaxes[0]


def test_too_few_balls_give_no_check() -> None:
    search, _ = observed(RIG, triads=1)
    left, right = search.observed.left, search.observed.right
    assert search_and_check_rig(search, left, right, RIG, RigCheckParameters())[1:] == (None, ())


SCALE = MarkerScale(12, 1.0044, 0.0011, 0.001, 0.0056, False, 0.15, -1.8)


def test_stages_show_together_what_one_does_not() -> None:
    assert not list(series_flags([]))
    assert not list(series_flags([SCALE]))
    (flag,) = series_flags([SCALE, SCALE, SCALE])
    assert flag.code == "calibration-drift"
    assert "1.0044" in flag.detail


def test_scales_of_sound_stages_are_rarely_flagged_together() -> None:
    """The calibration and the manufacture of the markers err alike in all stages."""
    rng = np.random.default_rng(2)
    flagged = 0
    for _ in range(500):
        common = rng.normal(0, SCALE.common_sd)
        scales = [replace(SCALE, scale=1 + common + rng.normal(0, SCALE.sd)) for _ in range(5)]
        flagged += any(list(series_flags(scales[:n])) for n in range(2, 6))
    assert flagged <= 0.02 * 500
