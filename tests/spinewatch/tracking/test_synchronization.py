"""Delay between the views against breathing."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.errors import ParameterError
from spinewatch.matching.epipolar import EpipolarParameters, nominal_ranges_mm
from spinewatch.rig_files.rig_json import rig_from_dict
from spinewatch.tracking.synchronization import (
    SynchronizationParameters,
    delay_flags,
    expected_movement_mm,
    max_delay_s,
    parallax_gain,
)
from tests.paths import SAMPLES

RIG = rig_from_dict(json.loads((SAMPLES / "D1" / "rig.json").read_text()))


def test_half_a_period_is_the_whole_movement() -> None:
    assert expected_movement_mm(2.0) == pytest.approx(2.0)
    assert expected_movement_mm(-2 / 3) == pytest.approx(1.0)  # 2 sin 30
    assert expected_movement_mm(0.0) == 0.0


@given(st.floats(1.0, 10.0), st.floats(0.01, 0.9))
def test_the_limit_is_where_the_expected_error_reaches_the_largest_one(gain: float, error: float) -> None:
    p = SynchronizationParameters(max_error_mm=error)
    assert expected_movement_mm(max_delay_s(gain, p), p) * gain == pytest.approx(error)


def test_a_limit_beyond_all_movement_is_never_reached() -> None:
    assert max_delay_s(1.0, SynchronizationParameters(max_error_mm=3.0)) == np.inf


def test_half_a_millimetre_between_the_exposures_of_the_cart_is_nine_tenths_of_error() -> None:
    assert 0.5 * parallax_gain(RIG) == pytest.approx(0.9, abs=0.06)


def test_the_gain_is_what_the_rays_of_a_moved_point_give() -> None:
    # the right ray sees the point moved across it, in the plane of both rays
    left, right = RIG.left.centre, RIG.right.centre
    range_mm = np.mean(nominal_ranges_mm(RIG, EpipolarParameters()))
    ahead = RIG.left.M[2] * range_mm
    point = left + ahead * np.sign(RIG.left.depth_mm(left + ahead))
    to_left, to_right = (end / np.linalg.norm(end) for end in (left - point, right - point))
    normal = np.cross(to_left, to_right)
    across = np.cross(normal, to_right) / np.linalg.norm(normal)
    moved = point + across
    A = np.column_stack([to_left, -to_right])
    along, _ = np.linalg.lstsq(A, moved - point, rcond=None)[0]
    assert abs(along) == pytest.approx(parallax_gain(RIG), rel=0.05)


def test_the_flag_names_the_later_view_and_the_numbers() -> None:
    (flag,) = delay_flags([0.001, -0.5, 0.2], 2.0)
    assert flag.code == "views-not-synchronous"
    assert "the left view was exposed 500 ms after the other one, and 2 of 3 pairs" in flag.detail
    assert "0.77 mm in that time, an error of up to 1.53 mm; at most 32 ms" in flag.detail


def test_views_within_the_limit_are_not_flagged() -> None:
    assert delay_flags([0.03, -0.03], 2.0) == ()
    assert delay_flags([], 2.0) == ()


def test_a_limit_of_nothing_is_refused() -> None:
    with pytest.raises(ParameterError, match="positive"):
        SynchronizationParameters(max_error_mm=0)
