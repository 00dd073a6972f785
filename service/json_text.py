"""JSON documents put together from stored JSON text, which is not parsed again.

They are lists of parts until the end, when they are joined once: to join members of members copies all of a document
each time, which took longer than to read it from the database.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from pydantic import BaseModel

Parts = Sequence[str]
"""JSON text in parts that follow each other."""


def with_members(document: BaseModel, members: Mapping[str, Parts]) -> Parts:
    """Return a model as JSON text whose members of these names are replaced by JSON text."""
    text = document.model_dump_json(exclude=set(members))
    parts = [text[:-1]]
    separator = "," if text != "{}" else ""
    for name, value in members.items():
        parts += (f'{separator}"{name}":', *value)
        separator = ","
    return [*parts, "}"]


def array(items: Iterable[Parts]) -> Parts:
    """Return a JSON array of JSON texts."""
    parts = ["["]
    for item in items:
        parts += ("," if len(parts) > 1 else "", *item)
    return [*parts, "]"]
