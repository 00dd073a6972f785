from functools import cache
from itertools import combinations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float, Pixels
from spinewatch.imaging.comparison import (
    ComparisonParameters,
    compare_images,
    may_be_equal,
    may_be_repeated,
    textured_strip,
)
from spinewatch.imaging.decoding import decode_image
from tests.paths import SAMPLES

STAGES = ("PRE", "INTER", "POST")


@cache
def sample(stage: str, side: str = "left") -> Pixels:
    return decode_image((SAMPLES / "D1" / stage / f"{side}.png").read_bytes())


def rounded(gray: Float) -> Pixels:
    return np.clip(np.rint(gray), 0, 255).astype(np.uint8)


def by_strip(first: Pixels, second: Pixels) -> tuple[bool, bool]:
    """Return whether the second image may be equal to the first, and whether it may repeat it."""
    strip = textured_strip(first)
    assert strip is not None
    return may_be_equal(strip, second), may_be_repeated(strip, second)


def exposure(gray: Float, noise: float, seed: int) -> Pixels:
    return rounded(gray + noise * np.random.default_rng(seed).standard_normal(gray.shape))


@pytest.mark.parametrize("side", ["left", "right"])
def test_other_stages_are_not_repeated(side: str) -> None:
    for first, second in combinations(STAGES, 2):
        compared = compare_images(sample(first, side), sample(second, side))
        assert not compared.repeated
        assert compared.noise_gray > 30
        assert by_strip(sample(first, side), sample(second, side)) == (False, False)


def test_the_same_pixels_are_the_same_image() -> None:
    compared = compare_images(sample("PRE"), sample("PRE").copy())
    assert (compared.exact, compared.repeated, compared.noise_gray) == (True, True, 0.0)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 2), st.floats(0.5, 5.0), st.floats(0.8, 1.25), st.sampled_from(STAGES))
def test_noise_and_brightness_do_not_hide_a_repetition(
    seed: int, noise: float, gain: float, stage: str
) -> None:
    gray = sample(stage).astype(np.float64)
    first, second = exposure(gray, noise, seed), exposure(gain * gray, noise, seed + 1)
    compared = compare_images(first, second)
    assert by_strip(first, second)[1]
    assert compared.repeated
    assert not compared.exact
    assert compared.displacement_px < 0.1
    assert compared.noise_gray == pytest.approx(noise * np.hypot(1, gain), rel=0.15, abs=0.3)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 2), st.floats(0.3, 8), st.floats(0, 6.3), st.floats(0, 3))
def test_a_moved_triad_before_a_still_background_is_another_image(
    seed: int, distance: float, direction: float, noise: float
) -> None:
    gray = sample("PRE").astype(np.float64)
    move = np.array([[1, 0, distance * np.cos(direction)], [0, 1, distance * np.sin(direction)]])
    moved, patch = gray.copy(), np.s_[150:230, 200:300]
    moved[patch] = cv2.warpAffine(gray, move, gray.shape[::-1], flags=cv2.INTER_CUBIC)[patch]
    assert not compare_images(exposure(gray, noise, seed), exposure(moved, noise, seed + 1)).repeated


def test_another_depth_of_the_same_image_is_the_same_image() -> None:
    gray = sample("PRE")
    assert compare_images(gray, (gray.astype(np.uint16) * 16).astype(np.uint16)).repeated


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_large_image_is_compared_reduced(dtype: type[np.unsignedinteger]) -> None:
    gray = np.kron(sample("PRE"), np.ones((6, 6)))
    first, again, moved = (
        (
            exposure(np.roll(gray, shift, axis=1), 3.0, seed).astype(dtype)
            * dtype(257 if dtype is np.uint16 else 1)
        )
        for shift, seed in ((0, 1), (0, 2), (6, 3))
    )
    compared = compare_images(first, again)
    assert compared.repeated
    assert not compared.exact
    assert compared.displacement_px < 0.6
    assert not compare_images(first, moved).repeated
    assert by_strip(first, again) == (False, True)
    assert by_strip(first, first) == (True, True)


def test_a_strip_leaves_what_it_cannot_tell_to_the_comparison() -> None:
    gray = sample("PRE")
    flat = np.full((200, 200), 90, np.uint8)
    assert by_strip(gray, gray) == (True, True)
    assert by_strip(flat, (flat + 1).astype(np.uint8)) == (False, True)
    assert by_strip(gray, gray[1:]) == (False, False)
    assert textured_strip(gray[:20]) is None
    strip = textured_strip(gray)
    assert strip is not None
    assert may_be_repeated(strip, gray[:, ::-1], ComparisonParameters(tile_px=32))


@pytest.mark.parametrize("highlight", [False, True])
def test_a_strip_of_16_bits_has_the_white_level_of_its_image(highlight: bool) -> None:
    gray = 3.0 * sample("PRE")  # at most 765, of 10 bits
    if highlight:
        gray[380:400, 10:30] = 4095.0

    def exposed(seed: int) -> Pixels:
        noise = 45.0 * np.random.default_rng(seed).standard_normal(gray.shape)
        return np.clip(np.rint(gray + noise), 0, 4095).astype(np.uint16)

    first, second = exposed(1), exposed(2)
    assert by_strip(first, second)[1] == compare_images(first, second).repeated == highlight


@pytest.mark.parametrize("shift_px", [96, 144, 240])
def test_a_strip_is_the_row_of_tiles_with_the_most_texture(shift_px: int) -> None:
    gray = np.full((300, 400), 90, np.uint8)
    gray[shift_px : shift_px + 48] = sample("PRE")[:48, :400]
    strip = textured_strip(gray)
    assert strip is not None
    assert strip.row == shift_px // 48
    assert np.array_equal(strip.pixels, gray[shift_px : shift_px + 48])
    assert strip.image_shape == (300, 400)


def test_a_difference_beyond_the_noise_of_any_camera_is_no_repetition() -> None:
    gray = sample("PRE").astype(np.float64)
    assert compare_images(exposure(gray, 9.0, 1), exposure(gray, 9.0, 2)).repeated
    first, second = exposure(gray, 14.0, 1), exposure(gray, 14.0, 2)
    assert not compare_images(first, second).repeated
    assert not by_strip(first, second)[1]


def test_images_without_texture_are_repeated_only_if_equal() -> None:
    flat = np.full((200, 200), 90, np.uint8)
    noisy = exposure(flat.astype(np.float64), 2.0, 1)
    assert compare_images(flat, flat).repeated
    assert not compare_images(noisy, exposure(flat.astype(np.float64), 2.0, 2)).repeated


@pytest.mark.parametrize("shape", [(1, 1), (20, 20), (47, 300)])
def test_images_smaller_than_a_tile_are_compared_exactly(shape: tuple[int, int]) -> None:
    gray = sample("PRE")[: shape[0], : shape[1]]
    assert compare_images(gray, gray).repeated
    assert not compare_images(gray, (gray ^ 1).astype(np.uint8)).repeated


def test_saturated_images_are_not_compared() -> None:
    white = np.full((200, 200), 255, np.uint8)
    almost = white.copy()
    almost[0, 0] = 254
    assert not compare_images(white, almost).repeated


def test_images_of_two_shapes_differ() -> None:
    assert not compare_images(sample("PRE"), sample("PRE")[1:]).repeated
