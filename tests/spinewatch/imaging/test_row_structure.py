"""Noise is no comb, doubled rows have no pairing."""

import numpy as np
import pytest

from spinewatch.imaging.row_structure import row_structure
from tests.spinewatch.imaging.degraded import sample, whole


def test_pure_noise_is_no_comb() -> None:
    comb, pairing = row_structure(whole(np.random.default_rng(4).normal(120, 5, (200, 300))))
    assert comb == pytest.approx(np.sqrt(3) / 2, abs=0.03)
    assert pairing > 0.98


def test_doubled_rows_differ_between_pairs_only() -> None:
    _, pairing = row_structure(whole(np.repeat(sample()[::2], 2, axis=0)))
    assert pairing == 0
