import math

import pytest

from spinewatch.imaging.pixel_spacing import are_unequal_spacings, plausible_spacing


@pytest.mark.parametrize("numbers", [(0.01, 0.02), (5.0, 2.5), (0.143, 0.15)])
def test_a_spacing_within_the_range_is_one(numbers: tuple[float, float]) -> None:
    assert plausible_spacing(numbers) == numbers


@pytest.mark.parametrize(
    "numbers",
    [
        *(
            (),
            (0.1,),
            (0.1, 0.1, 0.1),
            (0.009, 0.1),
            (0.1, 5.1),
            (-0.1, 0.1),
            (math.nan, 0.1),
            (0.1, math.inf),
        ),
        *((0.1, 0.21), (0.21, 0.1), (0.01, 5.0)),
    ],
)
def test_other_numbers_are_none(numbers: tuple[float, ...]) -> None:
    assert plausible_spacing(numbers) is None


@pytest.mark.parametrize(
    ("numbers", "unequal"), [((0.1, 0.21), True), ((0.1, 0.2), False), ((1e-9, 0.1), False)]
)
def test_only_spacings_within_the_range_are_told_unequal(numbers: tuple[float, float], unequal: bool) -> None:
    assert are_unequal_spacings(numbers) is unequal
