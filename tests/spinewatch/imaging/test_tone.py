from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.errors import ImageError
from spinewatch.imaging.tone import log_tone, patch_tone, to_gray


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
