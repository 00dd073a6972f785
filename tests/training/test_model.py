"""The network of the library answers as the model does."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs PyTorch, which the project does not install")

from spinewatch.detection.refinement.patches import PatchGrid  # noqa: E402
from training.model import Architecture, ball_network, random_model  # noqa: E402


@pytest.mark.parametrize("sees_others", [False, True])
def test_the_exported_network_has_the_outputs_of_the_model(sees_others: bool) -> None:
    torch.manual_seed(1)
    architecture = Architecture(PatchGrid(25, 5.0), 0.0, sees_others, ((5, 2, 6), (3, 2, 8)), 16)
    model = random_model(architecture)
    network = ball_network(architecture, model)
    rng = np.random.default_rng(2)
    shapes = ((3, 1 + sees_others, 25, 25), (3, 7))
    patches, light = (rng.normal(size=shape).astype(np.float32) for shape in shapes)
    with torch.no_grad():
        expected = model(torch.from_numpy(patches), torch.from_numpy(light)).numpy()
    assert network.sees_others == sees_others
    assert network.graph(patches, light) == pytest.approx(expected, abs=1e-5)
