from __future__ import annotations

import numpy as np

from spinewatch.spine.configuration import Origin, SpineConfiguration, SpinePoses


def configuration() -> SpineConfiguration:
    first, second = np.zeros((2, 6, 1)), np.zeros((2, 6, 2))
    first[0, 0] = 3.0
    second[0, 0, 1] = 4.0
    second[:, 5, 0] = 2.0
    return SpineConfiguration(
        ("T12", "L1"),
        (True, False),
        (Origin.MEASURED, Origin.NOT_MEASURED),
        (None, "it carries no triad"),
        SpinePoses(np.array([[0.0, 0, 30], [np.nan] * 3]), np.stack([np.eye(3), np.full((3, 3), np.nan)])),
        {"initial": first, "triads PRE": second},
    )


def test_covariances_sum_the_sources() -> None:
    covariances = configuration().covariances()
    expected = np.zeros((6, 6))
    expected[0, 0], expected[5, 5] = 25, 4
    assert np.allclose(covariances[0], expected)
    assert np.isnan(covariances[1]).all()


def test_the_place_of_a_vertebra() -> None:
    assert configuration().index("L1") == 1
