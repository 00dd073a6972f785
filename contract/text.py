"""Text that people read: without characters that hide or reorder it, and without what looks like a name."""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Mapping

from pydantic import ValidationInfo

from spinewatch.errors import SpinewatchError

_HIDDEN = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
"""Unicode categories of control, format, direction and private characters, and of separators of lines."""

STORED: Mapping[str, bool] = {"stored": True}
"""Validation context of a document of the record, which is read as an earlier version has accepted it."""


class NamedReferenceError(SpinewatchError):
    """A case number may contain a name."""

    code = "reference-not-opaque"


def visible(text: str) -> str:
    """Return a text; raise ``ValueError`` if it has characters that cannot be seen or that reorder others."""
    if any(unicodedata.category(character) in _HIDDEN for character in text):
        raise ValueError("it has control, direction or other invisible characters; remove them")
    if text != text.strip():
        raise ValueError("it begins or ends with a space; remove it")
    return text


def visible_if_new(text: str, info: ValidationInfo) -> str:
    """Return a text; raise as `visible` does, unless it is of a document of the record (`STORED`)."""
    return text if info.context == STORED else visible(text)


def require_opaque(reference: str, matches: Callable[[str], object]) -> None:
    """Raise ``NamedReferenceError`` if a case number does not match the pattern of the site."""
    if not matches(reference):
        raise NamedReferenceError(
            "the reference may contain a name; use the hospital's own case number, such as 2026-0417 (letters only"
            " between digits, or a short word before them), or have SPINEWATCH_REFERENCE_PATTERN set"
        )
