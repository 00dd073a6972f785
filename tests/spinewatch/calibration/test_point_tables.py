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


@pytest.mark.parametrize("separator", [";", "\t"])
def test_other_separators_and_decimal_commas_are_read(separator: str) -> None:
    text = f"{HEADER}\na,0,0.5,14.858,1,2.25\n"
    points = parse_image_points(text, "left.csv")["1"]
    for decimal in (".", ","):
        other = text.replace(",", separator).replace(".", decimal)
        again = parse_image_points(other, "left.csv")["1"]
        assert np.array_equal(again.control_mm, points.control_mm)
        assert np.array_equal(again.pixels, points.pixels)


def test_empty_fields_at_the_end_of_every_line_are_no_surplus() -> None:
    points = parse_image_points(f"{HEADER},\na,0,0,0,1,2,\n", "left.csv")["1"]
    assert points.pixels.tolist() == [[1, 2]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"{HEADER}\na,0,0,0,1,2\nb,0,0,14,858,1,2\n", "line 3: 7 fields for 6 columns.*decimal commas"),
        (f"{HEADER}\na,0,0,0,1\n", "line 2: 5 fields for 6 columns"),
        (f"{HEADER},u_px\na,0,0,0,1,2,3\n", "column 'u_px' twice"),
        (f"{HEADER}\na,0,0,0,1,2\nb,0,0,0.5,1,2,5\n".replace(",", ";"), "line 3: 7 fields"),
        (f"{HEADER}\na,0,0.5,0,1,2\n".replace(",", ";") + "b;0;0,5;0;1;2\n", "line 3: a number with a comma"),
        (f"{HEADER}\na,0,0,0,1,2\n".replace(",", ";") + "b;0;1,000,5;0;1;2\n", "line 3: y_mm is '1.000,5'"),
    ],
)
def test_a_table_that_would_be_read_wrongly_is_refused(text: str, words: str) -> None:
    with pytest.raises(PointsError, match=words):
        parse_image_points(text, "left.csv")


def test_a_control_field_with_decimal_commas_between_commas_is_refused() -> None:
    with pytest.raises(ControlFieldError, match=r"board\.csv, line 2: 5 fields for 4 columns"):
        parse_control_field("id,x_mm,y_mm,z_mm\n1,0,0,14,858\n", "board.csv")
