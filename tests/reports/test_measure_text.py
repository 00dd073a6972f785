import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports.measure_text import amount, interval, with_sd


@pytest.mark.parametrize(
    ("value", "unit", "signed", "text"),
    [
        (58.26, "deg", False, "58.3°"),
        (-4.0, "mm", False, "−4.0 mm"),
        (4.0, "mm", True, "+4.0 mm"),
        (-0.04, "deg", True, "0.0°"),
        (0.0, "deg", True, "0.0°"),
        (1.0, "", False, "1.0"),
        (None, "deg", True, "–"),
    ],
)
def test_an_amount_has_sign_and_unit(value: float | None, unit: str, signed: bool, text: str) -> None:
    assert amount(value, unit, signed=signed) == text


def test_an_interval_has_its_unit_once_and_signs_where_a_change_has_them() -> None:
    assert interval([-25.46, 1.0], "deg", signed=True) == "−25.5 to +1.0°"
    assert interval([56.144, 60.456], "mm") == "56.1 to 60.5 mm"
    assert interval([None, 1.0], "deg") == ""
    assert interval([], "deg") == ""


def test_a_value_with_an_unknown_deviation_shows_that_it_is_unknown() -> None:
    assert with_sd(-1.0, 0.44) == "−1.0 ± 0.4"
    assert with_sd(2.0, None) == "+2.0 ± ?"
    assert with_sd(None, 0.5) == "–"
    assert with_sd(2.0, 0.5, signed=False) == "2.0 ± 0.5"


@given(st.floats(-1e4, 1e4))
def test_an_amount_is_read_back_to_the_last_digit(value: float) -> None:
    text = amount(value, "deg", signed=True)
    assert math.isclose(float(text.removesuffix("°").replace("−", "-")), value, abs_tol=0.0501)
    assert "-" not in text
