"""JSON documents put together from stored JSON text, which is not parsed again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pydantic import BaseModel


def with_members(document: BaseModel, members: Mapping[str, str]) -> str:
    """Return a model as JSON text whose members of these names are replaced by JSON text."""
    text = document.model_dump_json(exclude=set(members))
    added = ",".join(f'"{name}":{value}' for name, value in members.items())
    return f"{text[:-1]}{',' if text != '{}' else ''}{added}}}"


def array(items: Sequence[str]) -> str:
    """Return a JSON array of JSON texts."""
    return f"[{','.join(items)}]"
