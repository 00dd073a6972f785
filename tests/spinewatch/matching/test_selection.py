from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.matching.points import Points
from spinewatch.matching.selection import select_triads
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.matching.triad_candidates import TriadCandidates, pad_features

PARAMETERS = SelectionParameters()


def candidates(origin: Float, log_odds: Float, features: list[list[int]]) -> TriadCandidates:
    n = len(origin)
    index = pad_features(np.array(features))
    return TriadCandidates(
        np.zeros(n, dtype=int), np.array(origin), np.tile(np.eye(3), (n, 1, 1)), log_odds, index, index
    )


def chain_of(n: int, log_odds: float = 12.0, axis: int = 0) -> TriadCandidates:
    origin = 50.0 * np.arange(n)[:, None] * np.eye(3)[axis]
    return candidates(origin, np.full(n, log_odds), [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(n)])


def points(n: int = 2) -> Points:
    corners = np.linspace(0, 300, n)[:, None] * np.ones(3)
    nothing, index = np.zeros(n), np.arange(n)
    return Points(corners, np.tile(np.eye(3), (n, 1, 1)), index, index, nothing, nothing, nothing, nothing)


@pytest.mark.parametrize("axis", ["x", "y", "auto"])
def test_a_chain_is_selected_in_order_along_the_axis(axis: str) -> None:
    along = "y" if axis == "auto" else axis
    found = chain_of(4, axis="xy".index(along)).take([2, 0, 3, 1])
    selected = select_triads(found, points(), PARAMETERS, axis=axis)  # type: ignore[arg-type]
    assert selected.tolist() == [1, 3, 0, 2]


def test_never_more_than_expected_or_than_the_largest_number() -> None:
    assert len(select_triads(chain_of(6), points(), PARAMETERS, expected=3, axis="x")) == 3
    few = replace(PARAMETERS, max_count=2)
    assert len(select_triads(chain_of(6), points(), few, axis="x")) == 2
    assert len(select_triads(TriadCandidates.empty(), points(), PARAMETERS)) == 0


def test_of_two_triads_with_the_same_feature_the_more_likely_chain_is_selected() -> None:
    origin = np.array([[0.0, 0, 0], [50, 0, 0], [75, 0, 0], [100, 0, 0]])
    found = candidates(origin, np.array([12.0, 12, 11, 12]), [[0, 1, 2], [3, 4, 5], [5, 6, 7], [8, 9, 10]])
    assert select_triads(found, points(), PARAMETERS, axis="x").tolist() == [0, 1, 3]
