"""Absolute differences of gray levels."""

import numpy as np
import pytest

from spinewatch.imaging.level_differences import at_most, differences


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_differences_are_those_of_whole_numbers_up_to_255(order: int, axis: int) -> None:
    levels = np.random.default_rng(order).integers(0, 256, (20, 30)).astype(np.uint8)
    expected = np.abs(np.diff(levels.astype(int), order, axis=axis)).clip(0, 255)
    assert np.array_equal(differences(levels, order, axis), expected)


def test_values_above_a_limit_are_equal_to_it() -> None:
    assert at_most(np.array([[3, 7, 9]], np.uint8), 7).tolist() == [[3, 7, 7]]
