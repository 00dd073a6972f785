import pytest
from sqlalchemy import select

from store.database import Database
from store.page import page_of
from store.tables import Surgery
from tests.store.builders import new_surgery


@pytest.mark.parametrize("limit", [1, 2, 5, 9])
def test_pages_together_have_every_row_once_and_in_order(database: Database, limit: int) -> None:
    added = {new_surgery(database) for _ in range(5)}
    query = select(Surgery).order_by(Surgery.id)
    with database.read() as session:
        pages = [page_of(session, query, limit, offset) for offset in range(0, 6, limit)]
    assert {page.total for page in pages} == {5}
    assert [row.id for page in pages for row in page.items] == sorted(added)
    assert all(len(page.items) <= limit for page in pages)
