from statistics import NormalDist

import pytest

from spinewatch.robust import MAD_TO_SD


def test_half_of_a_normal_distribution_deviates_less_than_its_median_absolute_deviation() -> None:
    assert 2 * NormalDist().cdf(1 / MAD_TO_SD) - 1 == pytest.approx(0.5, abs=1e-5)
