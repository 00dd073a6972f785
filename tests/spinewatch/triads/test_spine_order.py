import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.triads.pose import MeasuredTriad, Pose
from spinewatch.triads.spine_order import axis_number, axis_problem, in_order

LINE = np.array([[0.0, 0, 0], [50, 10, 0], [100, 20, 0], [150, 30, 0]])


def triad_at(x: float, y: float) -> MeasuredTriad:
    return MeasuredTriad("flat", {}, Pose(np.array([x, y, 0.0]), np.eye(3), np.zeros((6, 6))), 0.0)


@given(st.permutations(range(4)))
def test_triads_are_ordered_along_the_axis(order: list[int]) -> None:
    triads = [triad_at(50.0 * k, -10.0 * k) for k in order]
    assert [triad.position_mm[0] for triad in in_order(triads, "auto")] == [0, 50, 100, 150]
    assert [triad.position_mm[0] for triad in in_order(triads, "y")] == [150, 100, 50, 0]
    assert in_order([], "auto") == []


@pytest.mark.parametrize(("axis", "number"), [("x", 0), ("y", 1), ("auto", 0)])
def test_the_axis_is_that_given_or_that_of_greatest_extent(axis: SpineAxis, number: int) -> None:
    assert axis_number(LINE, axis) == number


def test_a_line_across_the_given_axis_is_a_problem() -> None:
    assert axis_problem(LINE, "x", 60.0, 5.0) is None
    assert "79 degrees to the spine axis y, more than 60" in (axis_problem(LINE, "y", 60.0, 5.0) or "")


def test_an_oblique_line_whose_orders_differ_has_no_order() -> None:
    oblique = np.array([[0.0, 0, 0], [40, 52, 0], [52, 40, 0], [100, 100, 0]])
    assert "give the spine axis, x or y" in (axis_problem(oblique, "auto", 60.0, 5.0) or "")
    assert axis_problem(oblique[[0, 1, 3]], "auto", 60.0, 5.0) is None
    assert axis_problem(oblique[:1], "auto", 60.0, 5.0) is None
