import json
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.json_check import JSONError, check_json
from service.limits import MAX_ERRORS, MAX_JSON_DEPTH, MAX_JSON_DIGITS, MAX_JSON_VALUES

FINITE = st.floats(allow_nan=False, allow_infinity=False)
TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\0"))
DOCUMENTS = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63) | FINITE | TEXT,
    lambda inner: st.lists(inner) | st.dictionaries(TEXT, inner),
    max_leaves=30,
)


def refused(text: str | bytes) -> list[tuple[tuple[str | int, ...], str, str]]:
    with pytest.raises(JSONError) as error:
        check_json(text if isinstance(text, bytes) else text.encode())
    return list(error.value.problems)


@given(DOCUMENTS)
def test_what_json_writes_is_taken(document: Any) -> None:
    check_json(json.dumps(document).encode())
    check_json(json.dumps(document, ensure_ascii=False).encode())


@given(st.binary(max_size=200))
def test_any_bytes_are_taken_or_refused_by_name(body: bytes) -> None:
    with suppress(JSONError):
        check_json(body)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ('{"a": {"b": [1, NaN]}}', ("a", "b", 1), "NaN"),
        ('{"a": 1e999}', ("a",), "too large"),
        ('{"a": -Infinity}', ("a",), "-Infinity"),
        (f'{{"a": {"9" * (MAX_JSON_DIGITS + 1)}}}', ("a",), "characters"),
        ('{"a": {"b": 1, "b": 2}}', ("a", "b"), "twice"),
        ('[{"a": "x\\u0000"}]', (0, "a"), "NUL"),
        ('["\\udc00"]', (0,), "surrogate"),
        ('{"a" 1}', (5,), "not JSON"),
    ],
)
def test_the_place_is_named(text: str, place: tuple[str | int, ...], words: str) -> None:
    ((found, sentence, _),) = refused(text)
    assert found == place
    assert words in sentence


@pytest.mark.parametrize("depth", [MAX_JSON_DEPTH + 1, 5_000])
@pytest.mark.parametrize(("opening", "closing"), [("[", "]"), ('{"a":', "}")])
def test_too_many_levels(depth: int, opening: str, closing: str) -> None:
    ((_, sentence, kind),) = refused(opening * depth + "1" + closing * depth)
    assert kind in {"too_deep", "too_many_values"}
    assert "send a" in sentence


def test_the_largest_number_of_levels_and_values_is_taken() -> None:
    check_json(b"[" * MAX_JSON_DEPTH + b"]" * MAX_JSON_DEPTH)
    check_json(json.dumps([0] * MAX_JSON_VALUES).encode())
    assert refused(json.dumps([0] * (MAX_JSON_VALUES + 1)))[0][2] == "too_many_values"


def test_commas_in_a_text_are_no_values() -> None:
    check_json(json.dumps({"note": ",[{" * MAX_JSON_VALUES + '"\\'}).encode())


def test_no_more_errors_than_an_answer_has() -> None:
    assert len(refused("[" + ",".join(["NaN"] * 1_000) + "]")) == MAX_ERRORS
    assert len(refused("{" + ",".join(f'"k{n}":1,"k{n}":1' for n in range(100)) + "}")) == MAX_ERRORS


def test_a_byte_order_mark_is_ignored() -> None:
    check_json(b"\xef\xbb\xbf{}")
