import numpy as np
import pytest

from spinewatch.detection.candidates.decision_space import decision_space, feature_space
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.similarity import Measure
from spinewatch.detection.candidates.templates import TemplateTree


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
