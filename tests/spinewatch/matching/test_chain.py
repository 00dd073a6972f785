from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.matching.chain import ChainCandidates, ChainParameters, best_chain, step_gains

VOLUME = 200.0**3


def brute_force(places: ChainCandidates, limit: int, p: ChainParameters) -> float:
    """The best value of any row, each of them tried."""
    steps = step_gains(places, 0, VOLUME, np.geomspace(*p.spacing_mm, 10), p)
    order = np.argsort(places.origin_mm[:, 0])
    best = 0.0
    for k in range(1, limit + 1):
        for row in combinations(order, k):
            if places.exclusive[np.ix_(row, row)][np.triu_indices(k, 1)].any():
                continue
            gain = sum((steps[:, a, b] for a, b in pairwise(row)), np.zeros(10))
            best = max(best, float((places.log_odds[list(row)] - p.min_log_odds).sum() + gain.max()))
    return best


def random_places(seed: int, n: int = 11) -> ChainCandidates:
    rng = np.random.default_rng(seed)
    origin = rng.uniform((0, 0, 0), (220, 40, 20), (n, 3))
    exclusive = rng.random((n, n)) < 0.25
    exclusive = exclusive | exclusive.T | np.eye(n, dtype=bool)
    return ChainCandidates(origin, rng.normal(6, 4, n), exclusive)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_the_row_is_the_best_of_all_rows(seed: int, limit: int) -> None:
    places, p = random_places(seed), ChainParameters()
    row, value = best_chain(places, 0, VOLUME, limit, p)
    assert value == pytest.approx(brute_force(places, limit, p), abs=1e-9)
    assert len(row) <= limit
    assert not places.exclusive[np.ix_(row, row)][np.triu_indices(len(row), 1)].any()
    assert (np.diff(places.origin_mm[row, 0]) > 0).all()


def test_distant_members_may_not_share_a_feature_either() -> None:
    origin = np.array([[0.0, 0, 0], [50, 0, 0], [100, 0, 0]])
    exclusive = np.eye(3, dtype=bool)
    exclusive[0, 2] = exclusive[2, 0] = True
    row, _ = best_chain(
        ChainCandidates(origin, np.array([9.0, 9, 8]), exclusive), 0, VOLUME, 3, ChainParameters()
    )
    assert row.tolist() == [0, 1]


def test_nothing_likely_is_an_empty_row() -> None:
    places = ChainCandidates(np.zeros((1, 3)), np.array([1.0]), np.eye(1, dtype=bool))
    row, value = best_chain(places, 0, VOLUME, 4, ChainParameters())
    assert len(row) == 0
    assert value == 0
