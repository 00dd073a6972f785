"""Stages from files that show the images of an earlier stage again, as the service flags them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from contract.flag import Flag
from contract.image import ImagePair
from contract.triad import Triad

_SIDES = ("left", "right")


@dataclass(frozen=True)
class ShownStage:
    """A stage and what shows its images again: their SHA-256, empty when unknown, and the triads measured in them."""

    name: str
    images: ImagePair
    triads: Sequence[Triad]

    def sha256(self, side: str) -> str:
        """Return the SHA-256 of an image, empty when unknown."""
        found: str = getattr(self.images, side).sha256
        return found

    def positions_mm(self) -> list[tuple[float, ...]]:
        """Return where triads and balls are, mm, in an order of their own, whatever the labels are."""
        found = [triad.position_mm for triad in self.triads if triad.position_mm is not None]
        found += [ball.position_mm for triad in self.triads for ball in triad.balls.values()]
        return sorted(map(tuple, found))


def repetition_flags(stage: ShownStage, earlier: Sequence[ShownStage]) -> Iterator[Flag]:
    """Yield ``frame-repeated`` for images or a result of an earlier stage, ``pair-mixed`` for one of the other side."""
    repeated = [
        f"the {side} image is that of stage {other.name} again"
        for side in _SIDES
        for other in _first(other for other in earlier if _is_same(stage, side, other, side))
    ]
    positions = stage.positions_mm()
    if not repeated and positions:
        # two exposures never give coordinates that are equal to the last digit
        same = _first(other for other in earlier if other.positions_mm() == positions)
        repeated = [f"the result is that of stage {other.name} again" for other in same]
    if repeated:
        detail = f"{'; '.join(repeated)}; give the images that were taken at this stage and their result"
        yield Flag(code="frame-repeated", detail=detail)
    for side, opposite in (_SIDES, _SIDES[::-1]):
        for other in _first(other for other in earlier if _is_same(stage, side, other, opposite)):
            detail = (
                f"the {side} image is the {opposite} image of stage {other.name}; give each as its own side"
            )
            yield Flag(code="pair-mixed", detail=detail)


def _first(found: Iterator[ShownStage]) -> list[ShownStage]:
    """Return the first stage alone, nothing if there is none."""
    return [stage for stage in (next(found, None),) if stage is not None]


def _is_same(stage: ShownStage, side: str, other: ShownStage, other_side: str) -> bool:
    return stage.sha256(side) != "" and stage.sha256(side) == other.sha256(other_side)
