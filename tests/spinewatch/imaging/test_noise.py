"""Noise is measured, and so is the share of gray levels that occur."""

import numpy as np
import pytest

from spinewatch.imaging.noise import levels_share, noise_levels
from tests.spinewatch.imaging.degraded import whole


@pytest.mark.parametrize("sd", [2.0, 5.0, 10.0])
def test_noise_is_measured(sd: float) -> None:
    image = np.random.default_rng(3).normal(120, sd, (200, 300))
    assert noise_levels(whole(image)) == pytest.approx(sd, rel=0.06)


def test_share_of_levels() -> None:
    ramp = np.tile(np.arange(256, dtype=np.uint8), (50, 1))
    assert levels_share(ramp) == 1
    assert levels_share(ramp // 32 * 32) < 0.05
