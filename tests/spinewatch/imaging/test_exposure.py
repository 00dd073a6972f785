from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from spinewatch.errors import ImageError
from spinewatch.imaging.exposure import (
    Exposure,
    PreprocessParameters,
    correct_exposure,
    gamma_correct,
    to_gray,
    truncated_median_filter,
)

images = hnp.arrays(np.uint8, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def truncated_median_of_nine(values: NDArray[Any]) -> float:
    """The filter's definition for one neighbourhood, written out."""
    s = np.sort(np.asarray(values, dtype=np.float64))[1:8]
    reach = min(s[3] - s[0], s[6] - s[3])
    return float(np.median(s[(s >= s[3] - reach) & (s <= s[3] + reach)]))


@given(images)
def test_truncated_median_follows_its_definition_at_every_pixel(image: NDArray[Any]) -> None:
    filtered = truncated_median_filter(image.astype(np.float32))
    padded = np.pad(image, 1, mode="edge")
    for (v, u), value in np.ndenumerate(filtered):
        assert value == truncated_median_of_nine(padded[v : v + 3, u : u + 3].ravel())


def test_truncated_median_sharpens_a_blurred_edge_without_moving_it() -> None:
    edge = np.tile(np.array([0, 0, 0, 60, 200, 255, 255, 255], dtype=np.float32), (8, 1))
    filtered = truncated_median_filter(edge)
    assert filtered[4, 3] <= 60
    assert filtered[4, 4] >= 200


def test_truncated_median_removes_an_impulse() -> None:
    image = np.full((7, 7), 50, dtype=np.float32)
    image[3, 3] = 255
    assert np.all(truncated_median_filter(image) == 50)


@given(st.floats(0, 255), st.sampled_from([1.5, 2.0]))
def test_gamma_brightens_and_keeps_black_and_white(level: float, gamma: float) -> None:
    v0, v, white = gamma_correct(np.array([0, level, 255], dtype=np.float32), gamma)
    assert v0 == 0
    assert white == pytest.approx(255)
    assert level - 1e-3 <= v <= 255.001


@pytest.mark.parametrize(
    ("mean", "kind"),
    [(150, Exposure.NORMAL), (60, Exposure.DARK), (12, Exposure.VERY_DARK)],
)
def test_gamma_is_applied_as_often_as_the_exposure_asks_for(mean: float, kind: Exposure) -> None:
    rng = np.random.default_rng(1)
    image = np.clip(rng.normal(mean, mean / 4, (60, 80)), 0, 255).astype(np.uint8)
    corrected, found = correct_exposure(to_gray(image), PreprocessParameters())
    assert found is kind
    assert corrected.mean() > 80


def test_saturated_and_blank_images_are_recognised() -> None:
    glare = np.full((40, 40), 255, dtype=np.uint8)
    glare[:20] = 90
    assert correct_exposure(to_gray(glare), PreprocessParameters())[1] is Exposure.GLARE
    assert correct_exposure(np.full((9, 9), 77, np.float32), PreprocessParameters())[1] is Exposure.BLANK


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
