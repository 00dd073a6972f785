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
