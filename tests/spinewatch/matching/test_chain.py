import json
from dataclasses import asdict
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.matching.chain import ChainCandidates, ChainParameters, best_chain, step_log_odds

VOLUME = 200.0**3


def brute_force(candidates: ChainCandidates, limit: int, p: ChainParameters) -> float:
    """The best value of any chain, each of them tried."""
    steps = step_log_odds(candidates, 0, VOLUME, p)
    order = np.argsort(candidates.origin_mm[:, 0])
    best = 0.0
    for k in range(1, limit + 1):
        for chain in combinations(order, k):
            if candidates.exclusive[np.ix_(chain, chain)][np.triu_indices(k, 1)].any():
                continue
            gain = sum((steps[:, a, b] for a, b in pairwise(chain)), np.zeros(p.n_spacings))
            best = max(best, float((candidates.log_odds[list(chain)] - p.min_log_odds).sum() + gain.max()))
    return best


def random_candidates(seed: int, n: int = 11) -> ChainCandidates:
    rng = np.random.default_rng(seed)
    origin = rng.uniform((0, 0, 0), (220, 40, 20), (n, 3))
    exclusive = rng.random((n, n)) < 0.25
    exclusive = exclusive | exclusive.T | np.eye(n, dtype=bool)
    return ChainCandidates(origin, rng.normal(6, 4, n), exclusive)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_the_chain_is_the_best_of_all_chains(seed: int, limit: int) -> None:
    candidates, p = random_candidates(seed), ChainParameters()
    chain, value = best_chain(candidates, 0, VOLUME, limit, p)
    assert value == pytest.approx(brute_force(candidates, limit, p), abs=1e-9)
    assert len(chain) <= limit
    assert not candidates.exclusive[np.ix_(chain, chain)][np.triu_indices(len(chain), 1)].any()
    assert (np.diff(candidates.origin_mm[chain, 0]) > 0).all()


def test_distant_members_may_not_share_a_feature_either() -> None:
    origin = np.array([[0.0, 0, 0], [50, 0, 0], [100, 0, 0]])
    exclusive = np.eye(3, dtype=bool)
    exclusive[0, 2] = exclusive[2, 0] = True
    chain, _ = best_chain(
        ChainCandidates(origin, np.array([9.0, 9, 8]), exclusive), 0, VOLUME, 3, ChainParameters()
    )
    assert chain.tolist() == [0, 1]


def test_unlikely_candidates_give_an_empty_chain() -> None:
    candidates = ChainCandidates(np.zeros((1, 3)), np.array([1.0]), np.eye(1, dtype=bool))
    chain, value = best_chain(candidates, 0, VOLUME, 4, ChainParameters())
    assert len(chain) == 0
    assert value == 0


def two_levels_skipped() -> ChainCandidates:
    origin = np.array([[0.0, 0, 0], [50, 0, 0], [150, 0, 0]])
    return ChainCandidates(origin, np.full(3, 9.0), np.eye(3, dtype=bool))


def test_the_probabilities_of_gap_ratios_are_parameters() -> None:
    even = ChainParameters(gap_ratios=((1.0, 1.0),))
    _, with_ratios = best_chain(two_levels_skipped(), 0, VOLUME, 3, ChainParameters())
    _, without = best_chain(two_levels_skipped(), 0, VOLUME, 3, even)
    assert with_ratios > without + 2


def test_after_the_largest_number_of_splits_the_weaker_of_two_is_dropped() -> None:
    candidates = random_candidates(3, n=14)
    exact, value = best_chain(candidates, 0, VOLUME, 6, ChainParameters())
    quick, less = best_chain(candidates, 0, VOLUME, 6, ChainParameters(max_splits=0))
    assert less <= value
    for chain in (exact, quick):
        assert not candidates.exclusive[np.ix_(chain, chain)][np.triu_indices(len(chain), 1)].any()


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_step_does_not_depend_on_where_the_chain_is(seed: int) -> None:
    candidates, p = random_candidates(seed, n=6), ChainParameters()
    moved = ChainCandidates(
        candidates.origin_mm + np.array([300.0, -20, 7]), candidates.log_odds, candidates.exclusive
    )
    here, there = (step_log_odds(c, 0, VOLUME, p) for c in (candidates, moved))
    assert np.allclose(here, there, atol=1e-9)


def test_the_parameters_are_plain_values() -> None:
    assert json.loads(json.dumps(asdict(ChainParameters())))["gap_ratios"][0] == [1.0, 0.72]
