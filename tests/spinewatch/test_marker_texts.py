"""Markers that may have been meant, and markers that cannot be in use together."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.errors import ParameterError
from spinewatch.marker_texts import other_markers, require_possible
from spinewatch.markers import FLAT_10_14_18, TriadModel, flat_triad, parse_marker


@given(st.permutations((18.0, 14.0, 10.0)))
def test_every_order_leads_to_the_marker_of_the_thesis(legs: list[float]) -> None:
    given_legs = flat_triad(*legs)
    others = [model.name for _, model in other_markers(given_legs)]
    assert (FLAT_10_14_18.name in others) == (legs != [18.0, 14.0, 10.0])
    assert given_legs.name not in others
    assert len(others) == len(set(others))


@pytest.mark.parametrize("factor", [2.0, 0.5, 10.0, 25.4])
def test_other_units_lead_back(factor: float) -> None:
    wrong = flat_triad(factor * 24, factor * 17, factor * 20)
    found = [model.coordinates_mm for _, model in other_markers(wrong)]
    assert any(np.allclose(one, flat_triad(24, 17, 20).coordinates_mm, atol=0.02) for one in found)


def test_the_text_makes_the_marker_and_orthogonal_legs_stay_orthogonal() -> None:
    for text, model in other_markers(parse_marker("orthogonal:30,22,16")):
        np.testing.assert_array_equal(parse_marker(text).coordinates_mm, model.coordinates_mm)
    texts = [text for text, _ in other_markers(parse_marker("orthogonal:30,22,16"))]
    assert {f"orthogonal:{a},{b},{c}" for a, b, c in permutations((30, 22, 16))} - set(texts) == {
        "orthogonal:30,22,16"
    }


def test_markers_that_no_text_describes_have_no_others() -> None:
    four = np.array([[18.0, 0, 0], [0, -15, 0], [-11, 0, 0], [0, 13, 9]])
    assert other_markers(TriadModel("four", ("A", "B", "C", "D"), four, 8.0)) == ()
    assert other_markers(TriadModel("three", ("A", "B", "C"), four[:3] + np.array([1.0, 2.0, 0]), 8.0)) == ()


def test_overlapping_balls_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"overlap: two are 7.2 mm apart"):
        require_possible([flat_triad(9.0, 4.0, 6.0)])


def test_markers_that_look_the_same_are_refused_and_a_mirrored_or_repeated_one_is_not() -> None:
    with pytest.raises(ParameterError, match="cannot be told apart"):
        require_possible([parse_marker("orthogonal:30,22,16"), parse_marker("orthogonal:22,16,30")])
    with pytest.raises(ParameterError, match="cannot be told apart"):
        require_possible([FLAT_10_14_18, flat_triad(18.3, 14, 10)])
    require_possible([FLAT_10_14_18, FLAT_10_14_18])
    require_possible([FLAT_10_14_18, flat_triad(10, 14, 18)])  # one of them would face away from the cameras
    require_possible([FLAT_10_14_18, flat_triad(22, 15, 12)])
