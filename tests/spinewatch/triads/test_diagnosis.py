from dataclasses import replace

import numpy as np
import pytest

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.epipolar import EpipolarParameters
from spinewatch.matching.points import MatchingParameters
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.diagnosis import Diagnosis, diagnose
from spinewatch.triads.search import SearchParameters

RIG = large_rig()


def observed(rig: Rig = RIG, seed: int = 1, dropped: range = range(0)) -> Observation:
    rng = np.random.default_rng(seed)
    noise = FeatureNoise(0.1, false_features=15)
    return observe(rig, random_spine(rng, 4, spacing_mm=45), rng, noise, dropped=dropped)


def cause(left: Features, right: Features, rig: Rig = RIG) -> Diagnosis:
    return diagnose(left, right, rig, SearchParameters(), [FLAT_10_14_18], expected=4, axis="x")


def rotated(*rotation_deg: float) -> Rig:
    return Rig("rotated", RIG.left, RIG.right.moved(np.radians(rotation_deg), np.zeros(3)))


def mirrored(features: Features, half_turn: bool) -> Features:
    xy = features.xy_px.copy()
    xy[:, 0] = RIG.left.image_size_px[0] - 1 - xy[:, 0]
    if half_turn:
        xy[:, 1] = RIG.left.image_size_px[1] - 1 - xy[:, 1]
    return replace(features, xy_px=xy)


@pytest.mark.parametrize("seed", range(4))
def test_exchanged_images(seed: int) -> None:
    seen = observed(seed=seed)
    found = cause(seen.right, seen.left)
    assert found.cause == "exchanged"
    assert found.detail.startswith("left and right are exchanged")


def with_range(near_mm: float, far_mm: float) -> SearchParameters:
    return SearchParameters(matching=MatchingParameters(epipolar=EpipolarParameters((near_mm, far_mm))))


@pytest.mark.parametrize("range_mm", [(300.0, 450.0), (900.0, 1200.0), (63.0, 76.0), (500.0, 560.0)])
@pytest.mark.parametrize("seed", range(3))
def test_markers_outside_the_range_that_was_given(seed: int, range_mm: tuple[float, float]) -> None:
    seen = observed(seed=seed)
    found = diagnose(seen.left, seen.right, RIG, with_range(*range_mm), [FLAT_10_14_18], expected=4, axis="x")
    assert found.cause == "range"
    assert f"range of {range_mm[0]:g} to {range_mm[1]:g} mm" in found.detail


@pytest.mark.parametrize(("range_mm", "named"), [((300.0, 450.0), True), ((500.0, 560.0), False)])
def test_a_range_that_is_far_off_is_named_when_no_ball_is_detected(
    range_mm: tuple[float, float], named: bool
) -> None:
    seen = observed(dropped=range(12))
    found = diagnose(seen.left, seen.right, RIG, with_range(*range_mm), [FLAT_10_14_18], expected=4, axis="x")
    assert found.cause.startswith("hidden")
    assert ("the optical axes meet at about 495 to 9" in found.detail) is named


def test_exchanged_images_with_a_range_are_not_taken_for_a_wrong_range() -> None:
    seen = observed()
    found = diagnose(
        seen.right, seen.left, RIG, with_range(550.0, 800.0), [FLAT_10_14_18], expected=4, axis="x"
    )
    assert found.cause == "exchanged"


def test_of_too_many_points_the_most_likely_are_used() -> None:
    seen = observed()
    few = SearchParameters(max_points=2)  # of two points no triad can be made
    found = diagnose(seen.right, seen.left, RIG, few, [FLAT_10_14_18], expected=4, axis="x")
    assert (found.cause, found.triads) == ("hidden", 0)
    enough = diagnose(
        seen.right, seen.left, RIG, replace(few, max_points=25), [FLAT_10_14_18], expected=4, axis="x"
    )
    assert enough.cause == "exchanged"


@pytest.mark.parametrize(("half_turn", "how"), [(False, "mirrored"), (True, "turned upside down")])
def test_mirrored_and_turned_images(half_turn: bool, how: str) -> None:
    seen = observed()
    left, right = (mirrored(f, half_turn) for f in (seen.left, seen.right))
    assert cause(left, right).detail.startswith(f"both images are {how}")
    assert cause(seen.left, right).detail == f"the right image is {how}"
    assert cause(left, seen.right).detail == f"the left image is {how}"


@pytest.mark.parametrize("pitch_deg", [0.2, -0.5, 1.0])
def test_a_rotation_across_the_epipolar_lines(pitch_deg: float) -> None:
    seen = observed(rotated(pitch_deg, 0, 0))
    found = cause(seen.left, seen.right)
    assert found.rig_has_moved
    assert f"{pitch_deg:.1f}" in found.detail
    assert found.triads == 4


def test_markers_of_another_size() -> None:
    base = RIG.right.M @ (RIG.right.centre - RIG.left.centre)
    seen = observed(Rig("longer", RIG.left, RIG.right.moved(np.zeros(3), 0.06 * base)))
    found = cause(seen.left, seen.right)
    assert found.rig_has_moved
    assert "-6% in size" in found.detail


def test_hidden_balls_of_images_that_belong_together_or_not_are_no_mistake() -> None:
    for seed in range(4):
        hidden = observed(seed=seed, dropped=range(0, 12, 3))
        assert cause(hidden.left, hidden.right).cause in {"hidden", "hidden-or-unrelated"}


def test_images_of_two_stages_have_no_cause() -> None:
    for seed in range(6):
        one, two = observed(seed=seed), observed(seed=seed + 10)
        assert cause(one.left, two.right).cause == "hidden-or-unrelated"


def test_images_of_parallel_cameras_belong_together_within_the_range_of_the_search() -> None:
    x, y, z = (RIG.left.centre + np.array([60.0, 0, 0]) @ RIG.left.M).tolist()
    parallel = Rig("parallel", RIG.left, replace(RIG.left, position_mm=(x, y, z)))
    seen = observed(parallel, dropped=range(0, 12, 3))
    epipolar = EpipolarParameters(range_mm=(500, 900))
    search = SearchParameters(matching=MatchingParameters(epipolar=epipolar))
    found = diagnose(seen.left, seen.right, parallel, search, [FLAT_10_14_18], expected=4, axis="x")
    assert found.cause == "hidden"


def test_no_features() -> None:
    seen = observed()
    assert cause(seen.left, Features.empty()).cause == "no-features"
