"""CSV: RFC 4180, numbers that read back exactly, and text that no spreadsheet runs."""

from __future__ import annotations

import csv
import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exports.csv_table import csv_table, harmless

texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\x00"))


def rows(content: bytes) -> list[list[str]]:
    return list(csv.reader(io.StringIO(content.decode(), newline=""), strict=True))


def original(cell: str) -> str:
    return cell[1:] if cell.startswith("'") else cell


@given(st.lists(st.tuples(texts, texts), min_size=1))
def test_text_reads_back_when_the_apostrophe_is_taken_away(table: list[tuple[str, str]]) -> None:
    header, *read = rows(csv_table(["a", "b"], table))
    assert header == ["a", "b"]
    assert [tuple(original(cell) for cell in row) for row in read] == table


@given(texts)
def test_no_text_begins_as_a_formula(text: str) -> None:
    assert not harmless(text).lstrip(" ").startswith(tuple("=+-@\t\r\n"))


@pytest.mark.parametrize(
    "text", ["=1", "+1", "-1", "@A1", "\t=1", "\r=1", "\n=1", "  =1", "＝1", "＋1", "－1", "＠A1", "'=1"]
)
def test_an_apostrophe_stands_before_a_formula(text: str) -> None:
    assert harmless(text) == f"'{text}"


def test_other_text_is_left_alone() -> None:
    for text in ("T9", "curve 1", "2026-0417", "a=b", "", " ", "Größe"):
        assert harmless(text) == text
    assert harmless("a\x00b") == "a\ufffdb"


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_read_back_exactly_and_stay_numbers(number: float) -> None:
    cell = rows(csv_table(["x_mm"], [[number]]))[1][0]
    assert float(cell) == number
    assert not cell.startswith("'")


def test_other_cells() -> None:
    assert csv_table(["a", "b", "c", "d"], [[None, True, False, -3]]) == b"a,b,c,d\r\n,true,false,-3\r\n"
