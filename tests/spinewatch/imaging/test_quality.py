"""Each degradation raises its own flag with its numbers, and sound images raise none."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.quality import (
    SOUND,
    QualityParameters,
    assess_image,
    bands,
    blockiness,
    exposure_flags,
    levels_share,
    noise_levels,
    raster_step,
    row_structure,
)
from tests.paths import SAMPLES

Change = Callable[[NDArray[Any]], NDArray[Any]]
PARAMETERS = QualityParameters()
STAGES = ("PRE", "INTER", "POST")


def sample(stage: str = "PRE", side: str = "left") -> NDArray[np.float32]:
    return decode_image((SAMPLES / "D1" / stage / f"{side}.png").read_bytes()).astype(np.float32)


def whole(image: NDArray[Any]) -> NDArray[np.uint8]:
    levels: NDArray[np.uint8] = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return levels


def jpeg(quality: int) -> Change:
    def change(image: NDArray[Any]) -> NDArray[Any]:
        buffer = BytesIO()
        Image.fromarray(whole(image)).save(buffer, "JPEG", quality=quality)
        return np.asarray(Image.open(buffer))

    return change


def fields_apart(shift: int) -> Change:
    def change(image: NDArray[Any]) -> NDArray[Any]:
        woven = image.copy()
        woven[1::2] = np.roll(image[1::2], shift, axis=1)
        return woven

    return change


def banded(image: NDArray[Any]) -> NDArray[Any]:
    rows = np.arange(len(image))[:, None]
    return image * (1 + 0.5 * np.sin(rows / 13)) / 1.5


def noisy(image: NDArray[Any]) -> NDArray[Any]:
    return image + np.random.default_rng(1).normal(0, 12, image.shape)


def lost(image: NDArray[Any]) -> NDArray[Any]:
    broken = image.copy()
    broken[200:216, 120:440] = 128
    return broken


def jumping(image: NDArray[Any]) -> NDArray[Any]:
    """Return a JPEG whose decoder lost its place at block (20, 30)."""
    broken = image.copy()
    broken[160:168, 240:] += 30
    broken[168:] += 30
    return jpeg(92)(broken)


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


def test_enlarged_images_have_no_blocks() -> None:
    enlarged = Image.fromarray(whole(sample())).resize((1136, 832), Image.Resampling.BICUBIC)
    assert blockiness(np.asarray(enlarged)) < PARAMETERS.max_blockiness


@pytest.mark.parametrize("sd", [2.0, 5.0, 10.0])
def test_noise_is_measured(sd: float) -> None:
    image = np.random.default_rng(3).normal(120, sd, (200, 300))
    assert noise_levels(whole(image)) == pytest.approx(sd, rel=0.06)


def test_pure_noise_is_no_comb() -> None:
    comb, pairing = row_structure(whole(np.random.default_rng(4).normal(120, 5, (200, 300))))
    assert comb == pytest.approx(np.sqrt(3) / 2, abs=0.03)
    assert pairing > 0.98


def test_bands_are_measured() -> None:
    rows = np.arange(416)[:, None]
    image = 120 * (1 + 0.4 * np.sin(2 * np.pi * 7 * rows / 416)) + np.zeros((416, 300))
    amplitude, _, cycles = bands(whole(image), 6, 4)
    assert cycles == 7
    assert amplitude == pytest.approx(0.4, abs=0.06)


def test_share_of_levels() -> None:
    ramp = np.tile(np.arange(256, dtype=np.uint8), (50, 1))
    assert levels_share(ramp) == 1
    assert levels_share(ramp // 32 * 32) < 0.05


def test_step_in_raster_order_is_found() -> None:
    step, share = raster_step(whole(jumping(sample())))
    assert step == pytest.approx(30, abs=5)
    assert share > 0.8


def test_the_darker_view_has_the_flag() -> None:
    image = sample()
    assert exposure_flags(image, image * 0.8, PARAMETERS) == ((), ())
    left, right = exposure_flags(image * 0.5, image, PARAMETERS)
    assert [flag.code for flag in left] == ["exposure-unequal"]
    assert right == ()
