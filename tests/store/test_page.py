from collections.abc import Sequence
from datetime import datetime

import pytest
from sqlalchemy import select

from contract.surgery import NewSurgery
from store import surgeries
from store.database import Database
from store.page import Page, PageRequest, Position, created_within, page_of, page_of_items
from store.tables.surgeries import Surgery
from tests.store.builders import CLIENT, NOON, at


def add(database: Database, reference: str = "a", now: datetime = NOON) -> str:
    new = NewSurgery(reference=reference, vertebrae=["L1"], reference_vertebra="L1")
    with database.write() as session:
        return surgeries.add(session, new, now, CLIENT).id


def page(database: Database, wanted: PageRequest) -> Page[Surgery]:
    with database.read() as session:
        return page_of(session, select(Surgery), Surgery, wanted)


def pages(database: Database, limit: int, sort: str) -> Sequence[list[str]]:
    found, wanted = [], PageRequest(limit, sort)
    while True:
        read = page(database, wanted)
        found.append([row.id for row in read.items])
        if read.next is None:
            return found
        wanted = PageRequest(limit, sort, read.next)


@pytest.mark.parametrize("limit", [1, 2, 5, 9])
@pytest.mark.parametrize("sort", ["created_at", "-created_at", "reference", "-reference"])
def test_pages_together_have_every_row_once_and_in_order(database: Database, limit: int, sort: str) -> None:
    rows = [(reference, second) for reference, second in zip("cabba", (1, 2, 2, 2, 3), strict=True)]
    ids = {add(database, reference, at(second)): (reference, second) for reference, second in rows}
    found = pages(database, limit, sort)
    field = 1 if "created_at" in sort else 0
    expected = sorted(((ids[i][field], i) for i in ids), reverse=sort.startswith("-"))
    assert [i for part in found for i in part] == [i for _, i in expected]
    assert all(len(part) <= limit for part in found)
    assert page(database, PageRequest(limit, sort)).total == 5


def test_rows_that_are_added_neither_repeat_nor_hide_others(database: Database) -> None:
    old = [add(database, now=at(second)) for second in range(4)]
    first = page(database, PageRequest(2))
    add(database, now=at(9))
    second = page(database, PageRequest(2, after=first.next))
    assert [row.id for row in (*first.items, *second.items)] == old[::-1]
    assert second.next is None


def test_the_last_full_page_has_no_next_one(database: Database) -> None:
    for _ in range(2):
        add(database)
    assert page(database, PageRequest(2)).next is None


def test_a_range_of_time_has_its_start_and_not_its_end(database: Database) -> None:
    ids = [add(database, now=at(second)) for second in range(3)]
    with database.read() as session:
        query = created_within(select(Surgery), Surgery, at(1), at(2))
        assert [row.id for row in session.scalars(query)] == [ids[1]]


def test_a_list_in_memory_goes_on_after_the_last_item() -> None:
    items = ["e", "d", "c", "b", "a"]

    def read(after: Position | None) -> Page[str]:
        return page_of_items(items, lambda item: Position(item, "x"), PageRequest(2, after=after))

    first = read(None)
    second = read(first.next)
    third = read(second.next)
    assert [first.items, second.items, third.items] == [["e", "d"], ["c", "b"], ["a"]]
    assert (first.total, third.next) == (5, None)
    assert read(Position("gone", "x")).items == []
