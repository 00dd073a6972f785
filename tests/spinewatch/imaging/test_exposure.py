import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.imaging.exposure import (
    Exposure,
    ExposureParameters,
    correct_exposure,
    gamma_correct,
)
from spinewatch.imaging.tone import to_gray


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
def test_gamma_is_applied_as_often_as_the_exposure_requires(mean: float, kind: Exposure) -> None:
    rng = np.random.default_rng(1)
    image = np.clip(rng.normal(mean, mean / 4, (60, 80)), 0, 255).astype(np.uint8)
    corrected, found = correct_exposure(to_gray(image), ExposureParameters())
    assert found is kind
    assert corrected.mean() > 80


def test_saturated_and_blank_images_are_recognized() -> None:
    glare = np.full((40, 40), 255, dtype=np.uint8)
    glare[:20] = 90
    assert correct_exposure(to_gray(glare), ExposureParameters())[1] is Exposure.GLARE
    assert correct_exposure(np.full((9, 9), 77, np.float32), ExposureParameters())[1] is Exposure.BLANK
