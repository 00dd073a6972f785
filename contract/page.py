"""Lists come in pages."""

from __future__ import annotations

from typing import Annotated, Any, Generic, TypeVar

from pydantic import Field

from contract.base import Schema

Item = TypeVar("Item")


class Listing(Schema, Generic[Item]):
    """A page of a list, newest first unless another order is asked for."""

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        """Return the name of a page of one kind of items, as the OpenAPI contract shows it."""
        return f"{params[0].__name__}Page"

    items: Annotated[
        list[Item], Field(description="The items of this page, in the order that was asked for.")
    ]
    total: Annotated[int, Field(description="Number of items in all pages.")]
    limit: Annotated[int, Field(description="Largest number of items in this page.")]
    next_cursor: Annotated[
        str | None, Field(description="The parameter `cursor` of the next page; null at the end of the list.")
    ]
