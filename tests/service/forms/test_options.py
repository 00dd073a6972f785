from typing import Annotated

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from service.forms.options import (
    INTERIOR,
    FixText,
    FreeText,
    PixelSizeText,
    parse_fix,
    parse_free,
    parse_pixel_size,
)

PIXEL_SIZE = TypeAdapter[str](PixelSizeText)
FREE = TypeAdapter[str](FreeText)
FIX = TypeAdapter[str](FixText)

numbers = st.decimals(-1000, 1000, places=6).map(str)
names = st.lists(st.sampled_from(INTERIOR), min_size=1, unique=True)


def accepts(adapter: TypeAdapter[str], text: str) -> bool:
    try:
        return adapter.validate_python(text) == text
    except ValidationError:
        return False


def test_the_names_are_those_of_the_solver() -> None:
    assert INTERIOR == ("f", "x0", "y0", "K1", "K2", "P1", "P2")


def test_pixel_size() -> None:
    assert parse_pixel_size("0.01,0.00845") == (0.01, 0.00845)
    assert accepts(PIXEL_SIZE, "1e-2,8.45e-3")


@pytest.mark.parametrize(
    "text",
    ["0.01", "0.01,", "0.01,0.01,0.01", "0,0.01", "0.01,-1", "nan,1", "1,inf", "1,1e999", " 1,1", "1,1\n"],
)
def test_what_is_not_a_pixel_size(text: str) -> None:
    assert not accepts(PIXEL_SIZE, text)


@given(names)
def test_every_list_of_distinct_names_is_accepted(chosen: list[str]) -> None:
    text = ",".join(chosen)
    assert accepts(FREE, text)
    assert parse_free(text) == chosen


@pytest.mark.parametrize("text", ["", "f,f", "zoom", "f;x0", "f, x0", "X0", "aspect", "f,"])
def test_what_is_not_a_list_of_names(text: str) -> None:
    assert not accepts(FREE, text)


@given(st.dictionaries(st.sampled_from(INTERIOR), numbers, min_size=1))
def test_every_assignment_of_numbers_is_accepted(values: dict[str, str]) -> None:
    text = ",".join(f"{name}={value}" for name, value in values.items())
    assert accepts(FIX, text)
    assert parse_fix(text) == {name: float(value) for name, value in values.items()}


@pytest.mark.parametrize("text", ["x0", "x0=", "x0=1,x0=2", "x0=nan", "x0=1e999", "x0==1", "y9=0", "x0=1,"])
def test_what_is_not_an_assignment(text: str) -> None:
    assert not accepts(FIX, text)


def test_the_schema_shows_the_grammar() -> None:
    schema = TypeAdapter(Annotated[FixText | None, "documented"]).json_schema()
    text, null = schema["anyOf"]
    assert (text["type"], text["examples"], null) == ("string", ["x0=0,y0=0"], {"type": "null"})
    assert text["pattern"].startswith("^(f|x0|y0|")
