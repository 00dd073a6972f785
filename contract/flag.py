"""Flags: named remarks on a result."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from contract.base import Schema

if TYPE_CHECKING:
    import spinewatch.flags


class Flag(Schema):
    """A named remark on a result."""

    code: Annotated[str, Field(description="The kind of remark, for machines; docs/flags.md lists them.")]
    detail: Annotated[str, Field(description="The remark, for people.")]

    @classmethod
    def of(cls, flags: Iterable[spinewatch.flags.Flag]) -> list[Flag]:
        """Return the contract models of the library's flags."""
        return [cls(code=flag.code, detail=flag.detail) for flag in flags]
