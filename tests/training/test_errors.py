"""Errors are of balls in full view, for all examples and each family that has any."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs PyTorch, which the project does not install")

from spinewatch.detection.refinement.networks import OUTPUTS, SCALES  # noqa: E402
from spinewatch.simulation.images.families import FAMILIES  # noqa: E402
from training.augmentation import BALL, VISIBLE, U  # noqa: E402
from training.errors import fit_errors  # noqa: E402


def test_errors_count_balls_in_full_view_by_family() -> None:
    outputs, truth = torch.zeros(6, len(OUTPUTS)), torch.zeros(6, 8)
    truth[:4, BALL], truth[:3, VISIBLE] = 1, 1
    outputs[:, OUTPUTS.index("log_odds")] = torch.tensor([1.0, 1.0, -1.0, 1.0, -1.0, -1.0])
    outputs[:, OUTPUTS.index("u")] = 0.1 / SCALES.offset
    families = np.zeros((6, len(FAMILIES)), dtype=bool)
    families[:2, 1] = True
    errors = fit_errors(outputs, truth, families)
    assert errors.classified == pytest.approx(5 / 6)
    assert set(errors.families) == {"all", FAMILIES[1]}
    everything = errors.families["all"]
    assert everything.balls == 3
    assert everything.found == pytest.approx(2 / 3)
    assert everything.rms_radii == pytest.approx(0.1 / np.sqrt(2), rel=1e-5)
    assert "3 balls" in str(errors)
    assert truth[0, U] == 0
