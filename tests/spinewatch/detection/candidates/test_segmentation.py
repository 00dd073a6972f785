import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.detection.candidates.segmentation import peaks


def bumps(*centres: tuple[float, float, float]) -> NDArray[np.float32]:
    y, x = np.mgrid[:40, :50]
    space = [h * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 12.5) for u, v, h in centres]
    return np.asarray(np.maximum.reduce(space), dtype=np.float32)


@given(st.floats(15, 25), st.floats(15, 25))
def test_a_peak_is_found_to_a_fraction_of_a_pixel(u: float, v: float) -> None:
    xy, score = peaks(bumps((u, v, 0.9)), max_peaks=5, radius_px=3, min_score=0.2)
    assert xy.shape == (1, 2)
    assert np.hypot(*(xy[0] - (u, v))) < 0.06
    assert score[0] == pytest.approx(0.9, abs=0.05)


def test_only_the_best_peaks_are_returned_in_order() -> None:
    xy, score = peaks(
        bumps((10, 10, 0.5), (30, 10, 0.9), (20, 30, 0.7)), max_peaks=2, radius_px=3, min_score=0.2
    )
    assert xy.round().tolist() == [[30, 10], [20, 30]]
    assert score[0] > score[1]


def test_an_empty_space_has_no_features() -> None:
    space = np.zeros((9, 9), dtype=np.float32)
    assert len(peaks(space, 10, 2, 0.1)[0]) == 0
