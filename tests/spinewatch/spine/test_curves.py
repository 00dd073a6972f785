from dataclasses import replace

import numpy as np
import pytest

from spinewatch.spine.configuration import SpineConfiguration, SpinePoses
from spinewatch.spine.curves import coronal_tilts, find_curves, measured_span
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.uncertainty import common_factors
from tests.spinewatch.spine.spines import LEVELS, disturbed, errors, scoliosis, tilted


def ends(spine: SpineConfiguration) -> list[tuple[str, str, str | None]]:
    return [(c.upper, c.lower, c.side) for c in find_curves(spine)]


def test_one_curve_by_hand() -> None:
    # From T12 to L1 the tilt turns by 8 degrees, from L4 to L5 by 1 degree.
    (curve,) = find_curves(tilted([-12.0, -20.0, -12.0, 5.0, 18.0, 17.0]))
    assert (curve.upper, curve.lower, curve.side, curve.open_ends) == ("L1", "L4", "right", ())


def test_a_curve_between_neighbours_is_reported_without_an_apex() -> None:
    first, second = find_curves(tilted([-2.0, -20.0, -12.0, 5.0, 18.0, 17.0]))
    assert (first.upper, first.apex, first.lower, first.side) == ("T12", None, "L1", "left")
    assert first.open_ends == ("T12",)
    assert (second.upper, second.lower) == ("L1", "L4")
    (three,) = find_curves(tilted([15.0, 20.0, 0.0]))
    assert (three.upper, three.apex, three.lower) == ("L4", None, "L5")


@pytest.mark.parametrize("sd_deg", [0.0, 0.5, 1.0, 2.0, 3.0])
def test_the_ends_of_a_sharp_curve_are_the_extremes_whatever_the_errors(sd_deg: float) -> None:
    tilts = [0.0, 5.0, 10.0, 16.0, 20.0, -18.0, -14.0, -10.0, -5.0, 0.0]
    spine = replace(tilted(tilts), errors={"triads A": errors(10, 0.3, sd_deg)})
    assert ends(spine) == [("T8", "T12", "right"), ("T12", "L1", "left"), ("L1", "L5", "right")]


def test_equal_tilts_are_no_turning_point() -> None:
    assert ends(tilted([20.0, 20.0, 0.0])) == [("L3", "L5", "left")]
    assert ends(tilted([-20.0, -10.0, 0.0, 0.0, 10.0, 20.0])) == [("T12", "L5", "right")]
    assert ends(tilted([0.0, 0.0, 0.0, 0.0])) == [("L2", "L5", None)]


def test_the_side_is_known_where_the_interval_of_the_angle_is_on_one_side_of_zero() -> None:
    tilts = [-3.0, -2.0, 0.0, 2.0, 3.0]
    sides = [
        find_curves(replace(tilted(tilts), errors={"initial": errors(5, 0.3, sd)}))[0].side
        for sd in (2.0, 2.3)
    ]
    assert sides == ["right", None]  # 6 degrees against 1.96 sqrt(2) sd
    other = tilted([5.0, -2.0, 0.0, 2.0, 4.0])
    spine = replace(tilted(tilts), alternatives=(other.poses,))
    assert find_curves(spine)[0].side is None


def test_the_apex_lies_farthest_to_the_convex_side() -> None:
    position = np.array([[0.0, 0, 100], [0, -5, 75], [0, -12, 50], [0, -9, 25], [0, 0, 0]])
    spine = tilted([-20.0, -15.0, 2.0, 15.0, 20.0])
    spine = replace(spine, poses=SpinePoses(position, spine.poses.rotation))
    (curve,) = find_curves(spine)
    assert (curve.upper, curve.apex, curve.lower, curve.side) == ("L1", "L3", "L5", "right")
    assert curve.open_ends == ("L1", "L5")


def test_a_double_curve_has_a_common_end_vertebra() -> None:
    assert ends(scoliosis()) == [("T1", "T5", "left"), ("T5", "T12", "right"), ("T12", "L5", "left")]
    names = [curve.name for curve in find_curves(scoliosis())]
    assert names == ["curve 1", "curve 2", "curve 3"]


def test_a_mirror_changes_sides_only() -> None:
    mirror = np.diag([1.0, -1.0, 1.0])
    spine = scoliosis()
    poses = SpinePoses(spine.poses.position_mm @ mirror, mirror @ spine.poses.rotation @ mirror)
    other: dict[str | None, str] = {"left": "right", "right": "left"}
    before, after = find_curves(spine), find_curves(replace(spine, poses=poses))
    assert [(c.upper, c.apex, c.lower, other[c.side]) for c in before] == [
        (c.upper, c.apex, c.lower, c.side) for c in after
    ]


def test_the_largest_curve_is_reported_even_when_it_is_small() -> None:
    tilts = np.array([0.0, -1.0, -3.0, -1.0, 1.0, 2.0, 1.5, 1.0])
    assert ends(tilted(tilts)) == [("T12", "L3", "right")]
    assert len(find_curves(tilted(tilts), MeasureParameters(min_cobb_deg=0.4))) == 3


def test_noise_makes_no_curves() -> None:
    rng = np.random.default_rng(3)
    truth = scoliosis()
    factors = {"triads A": errors(17, 0.3, 2.0)}
    for _ in range(50):
        spine = disturbed(truth, factors, {"triads A": rng.standard_normal(102)})
        found = find_curves(spine)
        assert 2 <= len(found) <= 3
        places = [(LEVELS.index(c.upper), LEVELS.index(c.lower)) for c in found if c.side == "right"]
        (upper, lower) = max(places, key=lambda place: place[1] - place[0])
        assert abs(upper - 4) <= 2
        assert abs(lower - 11) <= 2


def test_a_swing_within_its_errors_is_no_curve() -> None:
    tilts = np.concatenate([np.linspace(-30, 30, 8), np.linspace(26, 18, 4)])
    assert len(find_curves(tilted(tilts))) == 2
    unsure = replace(tilted(tilts), errors={"triads A": errors(12, 0.3, 12.0)})
    assert len(find_curves(unsure)) == 1


def test_curves_lie_between_the_first_and_the_last_marker() -> None:
    spine = scoliosis()
    marked = tuple(level in {"T7", "T9", "T11", "L1"} for level in LEVELS)
    curves = find_curves(replace(spine, marked=marked))
    assert [(c.upper, c.lower, c.open_ends) for c in curves] == [("T7", "T12", ("T7",))]
    one_marker = tuple(level == "T7" for level in LEVELS)
    assert list(measured_span(replace(spine, marked=one_marker))) == list(range(17))
    rotation = spine.poses.rotation.copy()
    rotation[:3] = np.nan
    partly = replace(spine, poses=SpinePoses(spine.poses.position_mm, rotation))
    assert list(measured_span(partly)) == list(range(3, 17))


def test_two_vertebrae_have_no_curve() -> None:
    assert find_curves(tilted([-20.0, 20.0])) == ()


def test_tilts_and_their_errors() -> None:
    spine = replace(tilted([0.0, 20.0, 0.0]), errors={"triads A": errors(3, 0.3, 1.5)})
    (factor,) = common_factors((spine,))
    tilts, found = coronal_tilts(spine, factor, np.array([1, 2]))
    assert tilts == pytest.approx([20.0, 0.0])
    assert np.linalg.norm(found, axis=1) == pytest.approx([1.5, 1.5])
