import numpy as np
import pytest

from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.errors import ControlFieldError
from spinewatch.calibration.point_tables import control_field_csv, parse_control_field


def test_a_control_field_survives_its_csv() -> None:
    field = pegboard_1995()
    again = parse_control_field(control_field_csv(field), "copy")
    assert again.ids == field.ids
    assert np.array_equal(again.points_mm, field.points_mm)


@pytest.mark.parametrize(
    "text",
    ["", "id,x_mm,y_mm\n1,0,0\n", "id,x_mm,y_mm,z_mm\n1,0,0,nan\n", "id,x_mm,y_mm,z_mm\n1,0,0,0\n1,1,1,1\n"],
)
def test_a_csv_that_is_no_control_field_is_refused(text: str) -> None:
    with pytest.raises(ControlFieldError):
        parse_control_field(text, "board.csv")
