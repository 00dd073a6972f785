from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.spine.configuration import Origin, Rebaseline, SpineConfiguration, SpinePoses


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


def with_both_measured(reference: str | None) -> SpineConfiguration:
    """T12 and L1 with an error of 3 mm along x that both have, and T12 with one of 4 mm along y."""
    shared, own = np.zeros((2, 6, 1)), np.zeros((2, 6, 1))
    shared[:, 0] = 3.0
    shared[1, 1] = 1.0
    own[0, 1] = 4.0
    return SpineConfiguration(
        ("T12", "L1"),
        (True, True),
        (Origin.MEASURED, Origin.MEASURED),
        (None, None),
        SpinePoses(np.array([[0.0, 0, 30], [0, 0, 0]]), np.stack([np.eye(3)] * 2)),
        {"initial": shared, "triads PRE": own},
        reference=reference,
    )


def test_positions_are_counted_from_the_origin_and_its_errors() -> None:
    found = with_both_measured("L1")
    assert found.origin == "L1"
    covariances = found.covariances()
    assert np.diag(covariances[0]).tolist() == [0, 17, 0, 0, 0, 0]
    assert not covariances[1].any()


def test_without_an_origin_the_errors_are_those_of_the_poses() -> None:
    for reference in (None, "S1"):
        found = with_both_measured(reference)
        assert found.origin is None
        assert np.diag(found.covariances()[1]).tolist() == [9, 1, 0, 0, 0, 0]


def test_a_reference_that_is_interpolated_is_not_the_origin() -> None:
    assert replace(with_both_measured("L1"), origins=(Origin.MEASURED, Origin.INTERPOLATED)).origin is None


def test_the_place_of_a_vertebra() -> None:
    assert configuration().index("L1") == 1


@pytest.mark.parametrize(
    ("one", "other", "within", "overlaps"),
    [
        ("A", "D", True, True),
        ("D", "A", True, True),
        ("B", "C", True, True),
        ("A", "C", True, True),
        ("A", "B", False, False),
        ("C", "D", False, False),
        ("B", "B", False, False),
    ],
)
def test_a_marker_was_clamped_again_between_two_stages(
    one: str, other: str, within: bool, overlaps: bool
) -> None:
    again = Rebaseline("T9", "B", "C")
    assert again.within("ABCD", one, other) == within
    assert again.overlaps("ABCD", one, other) == overlaps


def test_a_marker_that_is_elsewhere_for_a_part_of_the_time_overlaps_without_lying_within() -> None:
    again = Rebaseline("T9", "A", "C")
    assert not again.within("ABCD", "B", "D")
    assert again.overlaps("ABCD", "B", "D")
