import numpy as np
import pytest

from spinewatch.calibration.control_field import ControlField, built_in_field, low_high_field, pegboard_1995
from spinewatch.calibration.errors import ControlFieldError
from tests.spinewatch.calibration.simulated import FIELD


def test_the_board_of_table_3_2_is_built_in() -> None:
    assert built_in_field("pegboard-1995").ids == pegboard_1995().ids
    with pytest.raises(ControlFieldError, match="choose from pegboard-1995"):
        built_in_field("no such board")


def test_points_are_taken_by_name() -> None:
    assert np.array_equal(FIELD.take(["30", "2"]), FIELD.points_mm[[29, 1]])
    with pytest.raises(ControlFieldError, match="no point 31"):
        FIELD.take(["1", "31"])


def test_fields_refuse_duplicates_and_not_a_number() -> None:
    points = FIELD.points_mm.copy()
    with pytest.raises(ControlFieldError, match="twice"):
        ControlField("f", ("1", *FIELD.ids[:-1]), points)
    points[3] = points[2]
    with pytest.raises(ControlFieldError, match="same coordinates"):
        ControlField("f", FIELD.ids, points)
    points[3, 0] = np.nan
    with pytest.raises(ControlFieldError, match="not a number"):
        ControlField("f", FIELD.ids, points)
    with pytest.raises(ControlFieldError, match="no points"):
        ControlField("f", (), np.empty((0, 3)))


def test_designed_boards_alternate_low_and_high_inside_a_low_rim() -> None:
    heights = low_high_field(5, 6, 127.0, np.random.default_rng(0)).points_mm[:, 2].reshape(5, 6)
    inside = heights[1:-1, 1:-1] >= 60
    assert np.all(inside[:, 1:] != inside[:, :-1])
    assert np.all(inside[1:] != inside[:-1])
    assert np.all(heights[[0, -1]] <= 45)
    assert np.all(heights[:, [0, -1]] <= 45)
    with pytest.raises(ControlFieldError, match="at least 3 rows"):
        low_high_field(2, 6, 127.0, np.random.default_rng(0))
