"""Every kind of flag by its code, and flags, which have one of these codes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from spinewatch.flags import calibration, image, spine, stage
from spinewatch.flags.kind import FlagKind

FLAGS: Mapping[str, FlagKind] = {
    kind.code: kind for table in (image, stage, spine, calibration) for kind in table.KINDS
}
"""Every kind of flag by its code."""


@dataclass(frozen=True)
class Flag:
    """A flag raised on a result.

    Attributes
    ----------
    code
        Code of a kind in `FLAGS`.
    detail
        Sentence with the numbers that raised it, for people.
    """

    code: str
    detail: str

    def __post_init__(self) -> None:
        if self.code not in FLAGS:
            raise ValueError(f"{self.code!r} is no flag; add its kind to spinewatch/flags")
