"""Numbers that people type are read as they are meant, or refused with the reason."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.numbers import NumberTextError, parse_number


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("0", 0),
        ("-12", -12),
        ("+1.5", 1.5),
        ("1.", 1),
        (".5", 0.5),
        ("1e3", 1000),
        (" 2.5E-1\n", 0.25),
        ("007", 7),
    ],
)
def test_decimal_numbers_are_read(text: str, number: float) -> None:
    assert parse_number(text) == number


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_what_python_writes_is_read_again(number: float) -> None:
    assert parse_number(repr(number)) == number


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1_80", "underscore"),
        ("1_8.0", "underscore"),
        ("\u0661\u0668", "digits other than 0 to 9"),
        ("\uff11\uff18", "digits other than 0 to 9"),
        ("1\u00b2", "digits other than 0 to 9"),
        ("inf", "is not finite"),
        ("-Infinity", "is not finite"),
        ("NaN", "is not finite"),
        ("1e400", "not finite"),
        ("", "is not a number"),
        ("1,5", "is not a number"),
        ("0x10", "is not a number"),
        ("1 2", "is not a number"),
        ("1.5.0", "is not a number"),
        ("--1", "is not a number"),
        ("e5", "is not a number"),
        (".", "is not a number"),
        ("\u22121", "is not a number"),
    ],
)
def test_everything_else_is_refused_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(NumberTextError, match=reason):
        parse_number(text)
