import numpy as np
import pytest

from spinewatch.detection.features import Features
from spinewatch.matching.insertion import insertion_gains, member_gains
from spinewatch.matching.points import MatchingParameters, match_features
from spinewatch.matching.selection import chain_log_odds
from spinewatch.matching.selection_parameters import SelectionParameters, SpineAxis
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.simulation.rigs import large_rig

P = SelectionParameters()


def candidates(x_mm: list[float], log_odds: list[float]) -> TriadCandidates:
    n = len(x_mm)
    index = np.arange(4 * n).reshape(n, 4)
    origin = np.column_stack([400 + np.array(x_mm), np.full(n, 380.0), np.full(n, 90.0)])
    return TriadCandidates(
        np.zeros(n, dtype=np.intp), origin, np.tile(np.eye(3), (n, 1, 1)), np.array(log_odds), index, index
    )


RIG = large_rig()
BALLS = np.array([[400.0, 370, 80], [560, 400, 100]])
LEFT, RIGHT = (Features.with_sigma(c.project(BALLS), np.ones(2), 0.1) for c in (RIG.left, RIG.right))
POINTS = match_features(LEFT, RIGHT, RIG, 8.0, MatchingParameters())


def test_the_gain_is_the_difference_of_the_chains() -> None:
    members, other = candidates([0, 50, 150], [9.0, 9, 9]), candidates([100], [9.0])
    (gain,) = insertion_gains(members, other, POINTS, P, "x")
    both = TriadCandidates.concatenate([members, candidates([100], [9.0])])
    both = TriadCandidates(
        both.model, both.origin_mm, both.rotation, both.log_odds, *2 * [np.arange(16).reshape(4, 4)]
    )
    (_, with_it), (_, without) = (chain_log_odds(c, POINTS, P, axis="x") for c in (both, members))
    assert gain == np.float64(with_it - without).round(9) or abs(gain - (with_it - without)) < 1e-9
    assert gain > 0


def test_one_at_no_regular_place_gains_less() -> None:
    members = candidates([0, 50, 100], [9.0, 9, 9])
    regular, irregular = insertion_gains(members, candidates([150, 122], [9.0, 9.0]), POINTS, P, "x")
    assert regular > irregular


def test_across_the_chain_there_is_no_place() -> None:
    members = candidates([0, 50], [9.0, 9])
    beside = candidates([25], [9.0])
    beside.origin_mm[0, 1] += 200
    assert insertion_gains(members, beside, POINTS, P, "x")[0] == -np.inf


def test_without_a_chain_it_is_its_own() -> None:
    found = insertion_gains(TriadCandidates.empty(), candidates([0], [9.0]), POINTS, P)
    assert found.tolist() == [9.0 - P.chain.min_log_odds]


@pytest.mark.parametrize("axis", ["x", "auto"])
@pytest.mark.parametrize("x_mm", [[0], [0, 50], [100, 0, 50, 230], [0, 40, 900, 100], [0, 5, 50, 100]])
def test_the_gain_of_a_member_is_that_of_its_insertion_into_the_others(
    x_mm: list[float], axis: SpineAxis
) -> None:
    members = candidates(x_mm, [9.0 + k for k in range(len(x_mm))])
    members.origin_mm[:, 1] += 3 * np.arange(len(x_mm))
    every = np.arange(len(x_mm))
    expected = [
        insertion_gains(members.take(every != k), members.take([k]), POINTS, P, axis)[0] for k in every
    ]
    assert np.allclose(member_gains(members, POINTS, P, axis), expected, atol=1e-9)
