"""Named remarks on a result: nothing is dropped or doubted in silence."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Flag:
    """A stable ``code`` for machines (see docs/flags.md) and a sentence, ``detail``, for people."""

    code: str
    detail: str
