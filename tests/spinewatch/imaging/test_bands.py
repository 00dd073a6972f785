"""Bands over the height of an image are measured."""

import numpy as np
import pytest

from spinewatch.imaging.bands import bands
from tests.spinewatch.imaging.degraded import whole


def test_bands_are_measured() -> None:
    rows = np.arange(416)[:, None]
    image = 120 * (1 + 0.4 * np.sin(2 * np.pi * 7 * rows / 416)) + np.zeros((416, 300))
    amplitude, _, cycles = bands(whole(image), 6, 4)
    assert cycles == 7
    assert amplitude == pytest.approx(0.4, abs=0.06)


def test_bands_that_differ_along_the_width_are_none() -> None:
    rows, phases = np.arange(416)[:, None], np.repeat(np.arange(6), 50)
    image = 120 * (1 + 0.4 * np.sin(2 * np.pi * (7 * rows / 416 + phases / 6)))
    amplitude, ratio, _ = bands(whole(image), 6, 4)
    assert amplitude < 0.06 or ratio < 2
