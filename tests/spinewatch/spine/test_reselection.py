from dataclasses import replace

import numpy as np
import pytest

from spinewatch.spine.configuration import SpineConfiguration, SpinePoses
from spinewatch.spine.curves import find_curves
from spinewatch.spine.measure_functions import cobb_angle
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.reselection import (
    ReselectedEnds,
    ReselectionWindow,
    candidates_without_pose,
    reselected_ends,
    reselection_windows,
)
from spinewatch.spine.uncertainty import common_factors
from tests.spinewatch.spine.spines import disturbed, errors, scoliosis, tilted

TILTS = np.array([5.0, -10.0, -24.0, -15.0, 0.0, 14.0, 22.0, 9.0])  # T10 to L5
WHOLE = ReselectionWindow(("T10", "T11", "T12", "L1"), ("L3", "L4", "L5"), ("T12", "L4"))


def without(spine: SpineConfiguration, *levels: str) -> SpineConfiguration:
    rotation = spine.poses.rotation.copy()
    rotation[[spine.index(level) for level in levels]] = np.nan
    return replace(spine, poses=SpinePoses(spine.poses.position_mm, rotation))


def found(
    spine: SpineConfiguration,
    window: ReselectionWindow = WHOLE,
    bracketed: frozenset[str] = frozenset(),
    roughness_deg: float = 3.0,
) -> ReselectedEnds | None:
    parameters = MeasureParameters(tilt_roughness_deg=roughness_deg)
    return reselected_ends(spine, common_factors((spine,))[0], bracketed, window, parameters)


def ends(spine: SpineConfiguration, window: ReselectionWindow = WHOLE) -> tuple[str, str]:
    both = found(spine, window)
    assert both is not None
    return both.upper, both.lower


def cobb(spine: SpineConfiguration, window: ReselectionWindow) -> float:
    upper, lower = ends(spine, window)
    R = spine.poses.rotation
    return float(cobb_angle(R[spine.index(upper)], R[spine.index(lower)]))


def test_candidates_lie_between_apices() -> None:
    spine = scoliosis()
    apices = [curve.apex for curve in find_curves(spine)]
    windows = reselection_windows(spine, find_curves(spine))
    assert apices == ["T3", "T8", "L3"]
    assert [(w.upper[0], w.upper[-1], w.lower[0], w.lower[-1]) for w in windows] == [
        ("T1", "T2", "T4", "T8"),
        ("T3", "T7", "T9", "L3"),
        ("T8", "L2", "L4", "L5"),
    ]
    assert [w.ends for w in windows] == [("T1", "T5"), ("T5", "T12"), ("T12", "L5")]


def test_candidates_of_a_curve_without_an_apex_begin_at_its_ends() -> None:
    spine = tilted([-20.0, -10.0, 0.0, 10.0, 20.0, -20.0, -10.0, 0.0, 10.0, 20.0])
    windows = reselection_windows(spine, find_curves(spine))
    assert [(w.upper[0], w.upper[-1], w.lower[0], w.lower[-1]) for w in windows] == [
        ("T8", "T9", "T11", "T12"),
        ("T10", "T12", "L1", "L3"),
        ("L1", "L2", "L4", "L5"),
    ]


@pytest.mark.parametrize("size", [6.0, 2.0])
def test_a_curve_that_went_past_zero_has_its_extremes_on_the_other_side(size: float) -> None:
    tilts = size / 2 * np.array([0.5, 0.8, 1.0, 0.6, 0.0, -0.6, -1.0, -0.7])
    both = found(replace(tilted(tilts), errors={"triads A": errors(8, 0.3, 0.3)}))
    assert both is not None
    assert (both.upper, both.lower) == ("T12", "L4")
    assert both.opposite is None


def test_where_the_side_is_not_known_the_ends_on_the_other_side_are_given_too() -> None:
    tilts = np.array([0.5, 0.8, 1.0, 0.6, 0.0, -0.6, -1.0, -0.7])
    both = found(replace(tilted(tilts), errors={"triads A": errors(8, 0.3, 3.0)}))
    assert both is not None
    assert both.opposite is not None
    assert both.opposite != (both.upper, both.lower)
    assert {*both.opposite[:1]} <= {*WHOLE.upper}


def test_without_errors_they_are_the_extremes() -> None:
    assert ends(tilted(TILTS)) == ("T12", "L4")
    assert ends(tilted(-TILTS)) == ("T12", "L4")
    assert ends(tilted([5.0, -10.0, -13.0, -15.0, 0.0, 14.0, 12.0, 9.0])) == ("L1", "L3")


def test_a_vertebra_without_a_pose_takes_no_part() -> None:
    spine = without(tilted(TILTS), "L4")
    assert ends(spine) == ("T12", "L3")
    assert candidates_without_pose(spine, WHOLE) == ("L4",)
    assert found(without(tilted(TILTS), "L3", "L4", "L5")) is None
    assert candidates_without_pose(tilted(TILTS), WHOLE) == ()


def test_the_extremes_of_noise_are_hardly_taken_for_tilts() -> None:
    # Four vertebrae at each end have nearly the same tilt.
    truth = tilted([-20.0, -21.0, -21.0, -20.0, -12.0, 0.0, 12.0, 20.0, 21.0, 21.0, 20.0])
    window = ReselectionWindow(truth.levels[:5], truth.levels[6:], (truth.levels[2], truth.levels[7]))
    factors = {"triads A": errors(11, 0.3, 1.0)}
    rng = np.random.default_rng(0)
    plain, smooth = [], []
    for _ in range(400):
        spine = disturbed(truth, factors, {"triads A": rng.standard_normal(66)})
        plain.append(cobb(replace(spine, errors={}), window) - 42.0)
        smooth.append(cobb(spine, window) - 42.0)
    assert np.mean(plain) > 1.2
    assert np.mean(smooth) < 0.75 * np.mean(plain)


def test_selection_does_not_flatten_a_sharp_curve() -> None:
    truth = tilted([-5.0, -15, -30.0, -25, -12.0, 3.0, 18.0, 28.0, 15.0, 5.0, -3])
    window = ReselectionWindow(truth.levels[:5], truth.levels[6:], (truth.levels[2], truth.levels[7]))
    factors = {"triads A": errors(11, 0.3, 1.0)}
    rng = np.random.default_rng(0)
    angles = [
        cobb(disturbed(truth, factors, {"triads A": rng.standard_normal(66)}), window) for _ in range(200)
    ]
    assert abs(np.mean(angles) - 58.0) < 0.3


def test_a_vertebra_with_a_marker_is_preferred_and_the_others_are_rivals() -> None:
    # L4 is interpolated with 4 degrees of error and 2 degrees more tilted than L3, which has a marker.
    spine = tilted([5.0, -10.0, -24.0, -15.0, 0.0, 14.0, 16.0, 9.0])
    factor = np.zeros((8, 6, 1))
    factor[spine.index("L4"), 3, 0] = 4.0
    both = found(replace(spine, errors={"interpolation A": factor}), WHOLE, frozenset({"L4"}), 1000.0)
    assert both is not None
    assert (both.upper, both.lower, both.rivals) == ("T12", "L3", ("L4",))
    assert both.excess_deg == pytest.approx(16.0 + 4.0 - 14.0, abs=0.01)
    assert found(spine, WHOLE, frozenset({"L4"})) == ReselectedEnds("T12", "L4", (), 0.0, 0.0)
    left = replace(
        tilted([-5.0, 10.0, 24.0, 15.0, 0.0, -14.0, -16.0, -9.0]), errors={"interpolation A": factor}
    )
    other = found(left, WHOLE, frozenset({"L4"}), 1000.0)
    assert other is not None
    assert other.excess_deg == pytest.approx(-6.0, abs=0.01)


def test_what_the_selection_may_lose_by_hand() -> None:
    # Without smoothing: two equal tilts with errors of 1 degree differ by sqrt(2) e, whose positive part is 1/sqrt(pi).
    spine = tilted([-20.0, -20.0, 0.0, 40.0])
    factors = {"triads A": errors(4, 0.3, 1.0)}
    window = ReselectionWindow(("L2", "L3"), ("L4", "L5"), ("L2", "L5"))
    both = found(replace(spine, errors=factors), window, frozenset(), 1e6)
    assert both is not None
    assert both.selection_sd_deg == pytest.approx(1 / np.sqrt(np.pi), rel=1e-3)
