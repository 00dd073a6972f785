"""Lists come in pages."""

from __future__ import annotations

from typing import Annotated, Generic, TypeVar

from pydantic import Field

from contract.base import Schema

Item = TypeVar("Item")


class Listing(Schema, Generic[Item]):
    """A page of a list, oldest first."""

    items: list[Item]
    total: Annotated[int, Field(description="Number of items in all pages.")]
    limit: Annotated[int, Field(description="Largest number of items in this page.")]
    offset: Annotated[int, Field(description="Number of items before this page.")]
