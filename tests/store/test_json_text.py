"""JSON for columns."""

import pytest

from store.json_text import JsonText, to_json


def test_values_are_encoded_without_spaces_and_text_is_left_as_it_is() -> None:
    assert to_json({"a": [1, None, "b"]}) == '{"a":[1,null,"b"]}'
    assert to_json(JsonText('{"a": 1}')) == '{"a": 1}'
    assert to_json("text") == '"text"'


def test_what_is_stored_as_it_is_is_plain_text() -> None:
    assert type(to_json(JsonText("[]"))) is str


def test_a_number_that_is_not_finite_is_refused() -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        to_json([float("nan")])
