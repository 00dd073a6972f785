"""Each degradation raises its own flag with its numbers, and sound images raise none."""

from __future__ import annotations

import numpy as np
import pytest

from spinewatch.imaging.quality import SOUND, QualityParameters, assess_image, exposure_flags
from tests.spinewatch.imaging.degraded import (
    Change,
    banded,
    fields_apart,
    jpeg,
    jumping,
    lost,
    noisy,
    sample,
    whole,
)

PARAMETERS = QualityParameters()
STAGES = ("PRE", "INTER", "POST")


DEGRADED: dict[str, tuple[Change, str]] = {
    "JPEG of quality 85": (jpeg(85), "image-compressed"),
    "JPEG of quality 20": (jpeg(20), "image-compressed"),
    "doubled rows": (lambda image: np.repeat(image[::2], 2, axis=0), "image-interlaced"),
    "fields 2 px apart": (fields_apart(2), "image-interlaced"),
    "bands": (banded, "image-banded"),
    "noise": (noisy, "image-noisy"),
    "16 levels": (lambda image: image // 16 * 16 + 8, "image-coarse"),
    "a lost area": (lost, "image-damaged"),
    "a jump": (jumping, "image-damaged"),
}


@pytest.mark.parametrize(("change", "code"), DEGRADED.values(), ids=DEGRADED.keys())
@pytest.mark.parametrize("stage", STAGES)
def test_each_degradation_raises_its_flag_only(stage: str, change: Change, code: str) -> None:
    gray = whole(change(sample(stage))).astype(np.float32)
    flags = assess_image(gray, PARAMETERS).flags
    assert {flag.code for flag in flags} == {code}
    assert any(character.isdigit() for character in flags[0].detail)


SOUND_VARIANTS: dict[str, Change] = {
    "as it is": lambda image: image,
    "half as bright": lambda image: image / 2,
    "gamma": lambda image: 255 * (image / 255) ** 0.5,
    "cropped": lambda image: image[37:338, 51:454],
    "rotated": lambda image: image[::-1, ::-1],
    "a little noise": lambda image: image + np.random.default_rng(2).normal(0, 2, image.shape),
}


@pytest.mark.parametrize("change", SOUND_VARIANTS.values(), ids=SOUND_VARIANTS.keys())
@pytest.mark.parametrize("side", ["left", "right"])
def test_sound_images_have_no_flag_and_keep_their_deviations(side: str, change: Change) -> None:
    assert assess_image(whole(change(sample("POST", side))).astype(np.float32), PARAMETERS) == SOUND


def test_images_too_small_for_the_measures_are_not_judged() -> None:
    assert assess_image(np.zeros((60, 300), np.float32), PARAMETERS) == SOUND


def test_deviations_grow_with_compression() -> None:
    factors = [assess_image(jpeg(q)(sample()).astype(np.float32), PARAMETERS).sd_factor for q in (85, 60, 20)]
    assert 1 < factors[0] < factors[1] < factors[2] < 1.4


def test_interlacing_adds_to_the_deviations() -> None:
    quality = assess_image(fields_apart(2)(sample()), PARAMETERS)
    assert quality.extra_sd_px == PARAMETERS.interlaced_sd_px


def test_the_darker_view_has_the_flag() -> None:
    image = sample()
    assert exposure_flags(image, image * 0.8, PARAMETERS) == ((), ())
    left, right = exposure_flags(image * 0.5, image, PARAMETERS)
    assert [flag.code for flag in left] == ["exposure-unequal"]
    assert right == ()
