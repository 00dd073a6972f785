from __future__ import annotations

import pytest

from commands.shared.repeated_stages import ShownStage, repetition_flags
from contract.image import Image, ImagePair
from contract.triad import Triad
from tests.store.builders import triad


def shown(name: str, left: str = "", right: str = "", *triads: Triad) -> ShownStage:
    images = [
        Image(sha256=sha256, media_type="", width_px=0, height_px=0, size_bytes=0) for sha256 in (left, right)
    ]
    return ShownStage(name, ImagePair(left=images[0], right=images[1]), triads)


def at(label: str | None, x_mm: float) -> Triad:
    return Triad.model_validate(triad(label, position_mm=[x_mm, 0.0, 0.0]))


PRE = shown("PRE", "a", "b", at("L1", 1.0), at("T9", 2.0))


@pytest.mark.parametrize(
    ("stage", "codes", "words"),
    [
        (shown("POST", "c", "d", at("L1", 1.1), at("T9", 2.0)), [], ""),
        (shown("POST", "a", "d"), ["frame-repeated"], "the left image is that of stage PRE again; give"),
        (shown("POST", "a", "b"), ["frame-repeated"], "the right image is that of stage PRE again"),
        (shown("POST", "", "", at("T9", 2.0), at(None, 1.0)), ["frame-repeated"], "the result is that of stage PRE"),
        (shown("POST", "c", "a"), ["pair-mixed"], "the right image is the left image of stage PRE"),
        (shown("POST", "b", "a"), ["pair-mixed", "pair-mixed"], "the left image is the right image of stage PRE"),
        (shown("POST"), [], ""),
    ],
)  # fmt: skip
def test_a_stage_that_shows_an_earlier_one_again(stage: ShownStage, codes: list[str], words: str) -> None:
    flags = list(repetition_flags(stage, [shown("FIRST"), PRE]))
    assert [flag.code for flag in flags] == codes
    assert words in " ".join(flag.detail for flag in flags)


def test_the_first_stage_that_has_the_images_is_named() -> None:
    (flag,) = repetition_flags(shown("LAST", "a", "b"), [PRE, shown("POST", "a", "b")])
    assert "stage PRE again" in flag.detail
    assert "POST" not in flag.detail
