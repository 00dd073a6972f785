import pytest
from pydantic import ValidationError

from contract.flag import Flag
from contract.page import Listing


def test_a_page_holds_items_of_one_type() -> None:
    flag = {"code": "a", "detail": "b"}
    page = Listing[Flag].model_validate({"items": [flag], "total": 7, "limit": 1, "next_cursor": "abc"})
    assert page.items == [Flag(code="a", detail="b")]
    with pytest.raises(ValidationError):
        Listing[Flag].model_validate({"items": [1], "total": 7, "limit": 1, "next_cursor": "abc"})
