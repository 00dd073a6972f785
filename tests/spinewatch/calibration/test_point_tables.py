import numpy as np
import pytest

from spinewatch.calibration.errors import ControlFieldError, PointsError
from spinewatch.calibration.point_tables import control_field_csv, parse_control_field, parse_image_points
from tests.spinewatch.calibration.simulated import FIELD

HEADER = "id,x_mm,y_mm,z_mm,u_px,v_px"


def test_a_control_field_survives_its_csv() -> None:
    again = parse_control_field(control_field_csv(FIELD), "copy")
    assert again.ids == FIELD.ids
    assert np.array_equal(again.points_mm, FIELD.points_mm)


@pytest.mark.parametrize(
    "text",
    ["", "id,x_mm,y_mm\n1,0,0\n", "id,x_mm,y_mm,z_mm\n1,0,0,nan\n", "id,x_mm,y_mm,z_mm\n1,0,0,0\n1,1,1,1\n"],
)
def test_a_csv_that_is_no_control_field_is_refused(text: str) -> None:
    with pytest.raises(ControlFieldError):
        parse_control_field(text, "board.csv")


def test_image_points_are_grouped_by_shot_in_order_of_appearance() -> None:
    text = f"\ufeff{HEADER}, shot\r\na, 0,0,0, 10,20, second\r\n\r\nb,1,0,0,11,20,first\r\nb,1,0,0,12,21,second\r\n"
    shots = parse_image_points(text, "left.csv")
    assert list(shots) == ["second", "first"]
    assert shots["second"].ids == ("a", "b")
    assert shots["first"].pixels.tolist() == [[11, 20]]
    assert list(parse_image_points(f"{HEADER}\na,0,0,0,1,2\n", "left.csv")) == ["1"]


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("a,0,0,0,1,x", "left.csv, line 2: v_px is 'x'"),
        (",0,0,0,1,2", "line 2: the id is empty"),
        ("a,0,0,0,1,2\na,1,0,0,3,4", "left.csv, shot 1: point a is given twice"),
    ],
)
def test_a_line_that_cannot_be_used_is_named(lines: str, words: str) -> None:
    with pytest.raises(PointsError, match=words):
        parse_image_points(f"{HEADER}\n{lines}\n", "left.csv")
