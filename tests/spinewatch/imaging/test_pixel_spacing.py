import math

import pytest

from spinewatch.imaging.pixel_spacing import plausible_spacing


@pytest.mark.parametrize("numbers", [(0.01, 5.0), (0.143, 0.15)])
def test_a_spacing_within_the_range_is_one(numbers: tuple[float, float]) -> None:
    assert plausible_spacing(numbers) == numbers


@pytest.mark.parametrize(
    "numbers",
    [(), (0.1,), (0.1, 0.1, 0.1), (0.009, 0.1), (0.1, 5.1), (-0.1, 0.1), (math.nan, 0.1), (0.1, math.inf)],
)
def test_other_numbers_are_none(numbers: tuple[float, ...]) -> None:
    assert plausible_spacing(numbers) is None
