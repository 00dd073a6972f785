from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.errors import ImageError
from spinewatch.imaging.tone import defective_pixels, log_tone, patch_tone, to_gray


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_sixteen_bit_files_are_scaled_by_the_bits_they_use(bits: int) -> None:
    full = 2**bits - 1
    image = np.array([[0, full // 2, full]], dtype=np.uint16)
    assert to_gray(image)[0] == pytest.approx([0, 127.5, 255], abs=0.2)


@pytest.mark.parametrize(
    "image", [np.zeros((4, 4, 3), np.uint8), np.zeros((0, 5), np.uint8), np.zeros((4, 4), np.float64)]
)
def test_other_shapes_and_types_are_refused(image: NDArray[Any]) -> None:
    with pytest.raises(ImageError):
        to_gray(image)


@given(st.floats(0.1, 1), st.integers(0, 1000))
def test_the_lamp_changes_the_log_tone_by_a_constant(brightness: float, seed: int) -> None:
    gray = np.random.default_rng(seed).uniform(20, 250, (9, 11)).astype(np.float32)
    difference = log_tone(gray, 0.0, 0.0) - log_tone(np.float32(brightness) * gray, 0.0, 0.0)
    assert difference == pytest.approx(-np.log(brightness), abs=1e-4)


def test_blur_lowers_noise_and_keeps_the_mean() -> None:
    gray = np.random.default_rng(0).normal(100, 5, (60, 80)).astype(np.float32)
    plain, smooth = log_tone(gray, 4.0, 0.0), log_tone(gray, 4.0, 1.0)
    assert smooth.std() < 0.4 * plain.std()
    assert smooth.mean() == pytest.approx(plain.mean(), abs=2e-3)


def test_the_tone_of_patches_is_the_log_tone_in_place() -> None:
    gray = np.random.default_rng(0).uniform(0, 255, (5, 7)).astype(np.float32)
    wanted = log_tone(gray, 4.0, 0.0)
    tone = patch_tone(gray)
    assert np.shares_memory(tone, gray)
    np.testing.assert_array_equal(tone, wanted)


def test_one_hot_pixel_does_not_darken_the_image() -> None:
    image = np.random.default_rng(1).integers(100, 4000, (120, 160)).astype(np.uint16)
    hot = image.copy()
    hot[40, 60] = 65535
    assert defective_pixels(hot).tolist() == [[60, 40]]
    expected, gray = to_gray(image), to_gray(hot)
    assert gray[40, 60] == 255
    expected[40, 60] = gray[40, 60] = 0
    np.testing.assert_array_equal(gray, expected)


@pytest.mark.parametrize("shape", [(2, 1), (1, 2), (2, 2)])
def test_highlights_are_no_defects(shape: tuple[int, int]) -> None:
    image = np.full((300, 300), 1000, np.uint16)
    image[40 : 40 + shape[0], 60 : 60 + shape[1]] = 65535
    assert len(defective_pixels(image)) == 0


@pytest.mark.parametrize("level", [0, 1000, 4000])
def test_images_of_one_bit_depth_have_no_defects(level: int) -> None:
    image = np.full((200, 200), level, np.uint16)
    image[3, 4] = 2 * level
    assert len(defective_pixels(image)) == 0
    assert len(defective_pixels(np.zeros((9, 9), np.uint8))) == 0
