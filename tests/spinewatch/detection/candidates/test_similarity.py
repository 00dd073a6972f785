import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.detection.candidates.similarity import (
    Measure,
    Templates,
    compare_windows,
    extend_by_reflection,
    similarity_spatial,
)


def two(seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a window and a template, each of 35 pixels."""
    g, t = np.random.default_rng(seed).uniform(0, 255, (2, 35))
    return g, t


def written_out(g: NDArray[np.float64], t: NDArray[np.float64], measure: Measure) -> float:
    """The equations of section 4.3.1."""
    mean_free = (g - g.mean(), t - t.mean())
    match measure:
        case Measure.ED:
            return float(np.sqrt(((g - t) ** 2).sum()))
        case Measure.OCC:
            return float((g * t).sum())
        case Measure.CCN:
            return float((g * t).sum() / np.sqrt((g * g).sum() * (t * t).sum()))
        case Measure.CCM:
            return float((mean_free[0] * mean_free[1]).sum())
        case Measure.RHO:
            return float(np.corrcoef(g, t)[0, 1])


@given(st.integers(0, 2**32 - 1), st.sampled_from(list(Measure)))
def test_measures_follow_their_equations(seed: int, measure: Measure) -> None:
    g, t = two(seed)
    templates = Templates(t.reshape(1, 1, 7, 5), np.ones((7, 5)))
    value = compare_windows(g.reshape(1, 1, 7, 5), templates, measure)[0, 0]
    assert value == pytest.approx(written_out(g, t, measure), rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("measure", list(Measure))
def test_pixels_outside_the_mask_do_not_count(measure: Measure) -> None:
    g, t = (a.reshape(1, 1, 7, 5) for a in two(1))
    mask = np.ones((7, 5))
    mask[0, 0] = 0
    before = compare_windows(g, Templates(t, mask), measure)
    g[..., 0, 0] += 1000
    np.testing.assert_array_equal(compare_windows(g, Templates(t, mask), measure), before)


def test_each_pixel_is_compared_with_its_own_window() -> None:
    image = np.random.default_rng(0).uniform(0, 255, (2, 9, 8))
    templates = Templates(np.random.default_rng(1).uniform(0, 255, (3, 2, 3, 5)), np.ones((3, 5)))
    space = similarity_spatial(image, templates, Measure.RHO)
    assert space.shape == (3, 9, 8)
    alone = compare_windows(image[None, :, 3:6, 2:7], templates, Measure.RHO)[0]
    assert space[:, 4, 4] == pytest.approx(alone)


def test_reflection_repeats_the_border_only_where_there_is_too_little_to_reflect() -> None:
    plane = np.array([[1.0, 2.0, 3.0]]).repeat(3, axis=0)
    assert extend_by_reflection(plane, (1, 2), (5, 7))[0].tolist() == [3, 2, 1, 2, 3, 2, 1]
    assert extend_by_reflection(plane, (1, 3), (5, 9))[0].tolist() == [3, 2, 1, 1, 2, 3, 3, 2, 1]
