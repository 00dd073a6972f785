"""The network of the library answers as the model does."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs PyTorch, which the project does not install")

from spinewatch.detection.refinement.patches import PatchGrid  # noqa: E402
from training.model import Architecture, ball_network, random_model  # noqa: E402


def test_the_exported_network_has_the_outputs_of_the_model() -> None:
    torch.manual_seed(1)
    architecture = Architecture(PatchGrid(25, 5.0), 0.0, ((5, 2, 6), (3, 2, 8)), 16)
    model = random_model(architecture)
    network = ball_network(architecture, model)
    rng = np.random.default_rng(2)
    patches, light = (rng.normal(size=shape).astype(np.float32) for shape in ((3, 25, 25), (3, 7)))
    with torch.no_grad():
        expected = model(torch.from_numpy(patches)[:, None], torch.from_numpy(light)).numpy()
    assert network.graph(patches, light) == pytest.approx(expected, abs=1e-5)
