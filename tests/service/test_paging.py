import base64
import json
from collections.abc import Mapping
from typing import Any

import pytest

from service.paging import CursorError, Paging
from service.problems import InvalidInputError
from store.page import Page, Position
from tests.store.builders import NOON

LAST: Page[Any] = Page([], 3, Position(NOON, "row"))


def next_cursor(sort: str = "-created_at", page: Page[Any] = LAST, **filters: Any) -> str:
    document: Mapping[str, Any] = Paging(2, sort, None, **filters).document(page, [])
    return str(document["next_cursor"])


def test_a_cursor_leads_to_the_place_that_it_was_made_for() -> None:
    wanted = Paging(7, "-created_at", next_cursor(reference="a"), reference="a").wanted
    assert (wanted.limit, wanted.sort, wanted.after) == (7, "-created_at", Position(NOON, "row"))
    by_name: Page[Any] = Page([], 3, Position("cart \u00e4", "row"))
    wanted = Paging(7, "name", next_cursor("name", by_name)).wanted
    assert wanted.after == Position("cart \u00e4", "row")


def test_the_last_page_has_no_cursor() -> None:
    assert Paging(2, "name", None).document(Page([], 0, None), []) == {
        "items": [],
        "total": 0,
        "limit": 2,
        "next_cursor": None,
    }


@pytest.mark.parametrize(
    ("sort", "filters"), [("created_at", {"a": 1}), ("-created_at", {"a": 2}), ("-created_at", {})]
)
def test_a_cursor_holds_for_its_list_only(sort: str, filters: dict[str, Any]) -> None:
    cursor = next_cursor("-created_at", a=1)
    with pytest.raises(InvalidInputError) as refused:
        Paging(2, sort, cursor, **filters)
    assert (refused.value.code, refused.value.loc) == (CursorError.code, ["query", "cursor"])


def packed(document: object) -> str:
    return base64.urlsafe_b64encode(json.dumps(document).encode()).decode()


@pytest.mark.parametrize(
    "cursor",
    [
        "",
        "?",
        "\u00e4",
        "AAAA",
        packed({}),
        packed([]),
        packed(["a", "b"]),
        packed(["a", "b", 3]),
        packed("[" * 200),
    ],
)
def test_other_text_is_refused(cursor: str) -> None:
    with pytest.raises(InvalidInputError):
        Paging(2, "-created_at", cursor)


def test_a_time_without_a_zone_is_refused() -> None:
    made_for, _, row = json.loads(base64.urlsafe_b64decode(next_cursor() + "=="))
    for text in ("2026-11-21T12:00:00", "noon"):
        with pytest.raises(InvalidInputError):
            Paging(2, "-created_at", packed([made_for, text, row]))


def crafted(sort: str, last: Position, text: str, row: str = "row") -> str:
    made_for, *_ = json.loads(base64.urlsafe_b64decode(next_cursor(sort, Page([], 3, last)) + "=="))
    return packed([made_for, text, row])


@pytest.mark.parametrize(
    "text",
    [
        "0001-01-01T00:00:00+14:00",
        "9999-12-31T23:59:59-14:00",
        "2026-11-21T12:00:00+01:00",
        "2026-11-21T12:00:00Z",
        "2026-W01-1T00:00:00+00:00",
        "20261121T120000+0000",
        "\ud800",
    ],
)
def test_a_time_that_no_cursor_of_the_list_has_is_refused(text: str) -> None:
    Paging(2, "created_at", crafted("created_at", Position(NOON, "row"), NOON.isoformat()))
    with pytest.raises(InvalidInputError) as refused:
        Paging(2, "created_at", crafted("created_at", Position(NOON, "row"), text))
    assert refused.value.code == CursorError.code


@pytest.mark.parametrize("text", ["\ud800", "a\0"])
def test_text_that_no_column_has_is_refused(text: str) -> None:
    last = Position("cart 1", "row")
    Paging(2, "reference", crafted("reference", last, "cart 2", "row 2"))
    for value, row in ((text, "row"), ("cart 1", text)):
        with pytest.raises(InvalidInputError) as refused:
            Paging(2, "reference", crafted("reference", last, value, row))
        assert refused.value.code == CursorError.code


def test_a_cursor_that_is_written_otherwise_is_refused() -> None:
    made_for, text, row = json.loads(base64.urlsafe_b64decode(next_cursor() + "=="))
    spaced = base64.urlsafe_b64encode(json.dumps([made_for, text, row], indent=1).encode()).decode()
    with pytest.raises(InvalidInputError):
        Paging(2, "-created_at", spaced)


def by_number(number: int) -> Position:
    return Position(str(number), "row")


def test_a_list_in_memory_goes_on_after_one_of_its_items_only() -> None:
    first = Paging(2, "-take", None).page_of([3, 2, 1], by_number)
    following = next_cursor("-take", Page([], 3, first.next))
    assert Paging(2, "-take", following).page_of([3, 2, 1], by_number).items == [1]
    for text in ("abc", "1.5", "", "-1", "4", "02"):
        paging = Paging(2, "-take", crafted("-take", by_number(2), text))
        with pytest.raises(InvalidInputError) as refused:
            paging.page_of([3, 2, 1], by_number)
        assert (refused.value.code, refused.value.loc) == (CursorError.code, ["query", "cursor"])
