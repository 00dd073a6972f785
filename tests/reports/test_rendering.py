import pytest
from jinja2 import UndefinedError

from reports.rendering import format_number, render


def test_a_number_is_formatted_and_an_unknown_one_is_a_dash() -> None:
    assert format_number(1.23456, "+.2f") == "+1.23"
    assert format_number(0.0, ".1f") == "0.0"
    assert format_number(None, ".2f") == "–"


def test_a_missing_variable_is_an_error() -> None:
    with pytest.raises(UndefinedError):
        render("cameras.html", document={"cameras": []})
