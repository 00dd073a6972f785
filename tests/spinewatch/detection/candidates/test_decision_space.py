import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.detection.candidates.decision_space import (
    decision_space,
    feature_space,
    peaks,
    threshold_components,
)
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.similarity import Measure
from spinewatch.detection.candidates.templates import TemplateTree


def bumps(*centres: tuple[float, float, float]) -> NDArray[np.float32]:
    y, x = np.mgrid[:40, :50]
    space = [h * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 12.5) for u, v, h in centres]
    return np.asarray(np.maximum.reduce(space), dtype=np.float32)


@given(st.floats(15, 25), st.floats(15, 25))
def test_a_peak_is_found_to_a_fraction_of_a_pixel(u: float, v: float) -> None:
    xy, score = peaks(bumps((u, v, 0.9)), budget=5, radius=3, floor=0.2)
    assert xy.shape == (1, 2)
    assert np.hypot(*(xy[0] - (u, v))) < 0.06
    assert score[0] == pytest.approx(0.9, abs=0.05)


def test_the_budget_keeps_the_best_peaks_in_order() -> None:
    xy, score = peaks(bumps((10, 10, 0.5), (30, 10, 0.9), (20, 30, 0.7)), budget=2, radius=3, floor=0.2)
    assert xy.round().tolist() == [[30, 10], [20, 30]]
    assert score[0] > score[1]


def test_components_of_the_best_pixels_have_weighted_centroids() -> None:
    space = np.zeros((9, 9), dtype=np.float32)
    space[2, 2], space[2, 3], space[3, 4], space[7, 7], space[0, 8] = 0.8, 0.4, 0.4, 0.6, 0.1
    xy, score = threshold_components(space, budget_px=4)
    assert xy == pytest.approx(np.array([[2.75, 2.25], [7, 7]]))
    assert score == pytest.approx([0.8, 0.6])


def test_an_empty_space_has_no_features() -> None:
    space = np.zeros((9, 9), dtype=np.float32)
    assert len(threshold_components(space, 10)[0]) == 0
    assert len(peaks(space, 10, 2, 0.1)[0]) == 0


def test_feature_space_weighs_edges_twice_as_the_thesis() -> None:
    assert feature_space([np.array([0.3]), np.array([0.9])], [1, 2]) == pytest.approx([0.7])


def test_the_gate_closes_where_the_root_is_unlike_and_representatives_decide_elsewhere() -> None:
    rng = np.random.default_rng(2)
    leaves = rng.normal(size=(2, 1, 7, 7))
    tree = TemplateTree(PropertySpace.GRAY, leaves.mean(axis=0, keepdims=True), leaves, np.ones((7, 7)))
    image = 0.01 * rng.normal(size=(1, 30, 30))
    image[0, 10:17, 10:17] = leaves[1, 0]
    gated = decision_space(image, tree, Measure.RHO, gate=0.5)
    assert gated[13, 13] == pytest.approx(1, abs=1e-6)
    relaxed = decision_space(image, tree, Measure.RHO, gate=None)
    assert np.all(gated[relaxed < 0.5] == 0)
    assert decision_space(image, tree, Measure.RHO, gate=1.1).max() == 0
