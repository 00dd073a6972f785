import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.detection.candidates.correlation import similarity
from spinewatch.detection.candidates.similarity import Measure, Templates, similarity_spatial


def case(seed: int, planes: int = 1, count: int = 2) -> tuple[NDArray[np.float64], Templates]:
    rng = np.random.default_rng(seed)
    image = rng.uniform(0, 255, (planes, 17, 23))
    templates = rng.uniform(0, 255, (count, planes, 7, 5))
    y, x = np.mgrid[-3:4, -2:3]
    return image, Templates(templates, ((x / 2.2) ** 2 + (y / 3.1) ** 2 <= 1).astype(np.float64))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(list(Measure)), st.integers(1, 2))
def test_fourier_form_equals_the_direct_sums(seed: int, measure: Measure, planes: int) -> None:
    image, templates = case(seed, planes)
    direct = similarity_spatial(image, templates, measure)
    fast = similarity(image, templates, measure)
    assert np.abs(fast - direct).max() <= 1e-6 * np.abs(direct).max()


@pytest.mark.parametrize("measure", [Measure.CCN, Measure.RHO])
def test_normalized_measures_are_one_on_the_template_itself(measure: Measure) -> None:
    image, templates = case(3, count=1)
    image[0, 5:12, 8:13] = templates.planes[0, 0]
    assert similarity(image, templates, measure)[0, 8, 10] == pytest.approx(1)
    assert similarity(image, templates, measure).max() <= 1 + 1e-9


def test_euclidean_difference_is_zero_on_the_template_itself() -> None:
    image, templates = case(4, count=1)
    image[0, 5:12, 8:13] = templates.planes[0, 0]
    assert similarity(image, templates, Measure.ED)[0, 8, 10] == pytest.approx(0, abs=1e-4)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.floats(0.2, 5), st.floats(-50, 50))
def test_the_correlation_coefficient_ignores_contrast_and_brightness(
    seed: int, contrast: float, brightness: float
) -> None:
    image, templates = case(seed)
    plain = similarity(image, templates, Measure.RHO)
    assert similarity(contrast * image + brightness, templates, Measure.RHO) == pytest.approx(plain, abs=1e-6)


def test_a_flat_image_resembles_nothing() -> None:
    _, templates = case(5)
    flat = np.full((1, 17, 23), 80.0)
    assert np.all(similarity(flat, templates, Measure.RHO) == 0)
