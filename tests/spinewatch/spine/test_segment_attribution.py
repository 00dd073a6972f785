import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.spine.segment_attribution import displacement_shares, distraction_excess

seeds = st.integers(0, 2**32 - 1)
CHAIN = [1, 2, 3, None]


def test_one_segment_by_hand() -> None:
    # 30 mm straight up becomes 50 mm, 40 of them to the right: u goes from (0, 1) to (0.8, 0.6) (right, up).
    before = np.array([[0.0, 0, 30], [0, 0, 0]])
    after = np.array([[0.0, -40, 30], [0, 0, 0]])
    shares = displacement_shares(before, after, [1, None]).shares_mm
    # Rotation: mean length 40 times 0.8; distraction: 20 mm longer at the mean direction 0.4.
    assert shares[0] == pytest.approx([40.0, 32.0, 8.0])
    assert not shares[1].any()


@settings(deadline=None)
@given(seeds)
def test_pure_distraction_and_pure_rotation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps = np.array([0, 0, 25.0]) + rng.uniform(-8, 8, (3, 3))

    def spine(steps: np.ndarray) -> np.ndarray:
        return np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 3))])

    longer = displacement_shares(spine(steps), spine(steps * rng.uniform(0.8, 1.3, (3, 1))), CHAIN)
    assert longer.shares_mm[:, 1] == pytest.approx(np.zeros(4), abs=1e-9)
    assert longer.shares_mm[:, 2] == pytest.approx(longer.shares_mm[:, 0], abs=1e-9)
    turned = np.einsum("nij,nj->ni", Rotation.random(3, rng=rng).as_matrix(), steps)
    bent = displacement_shares(spine(steps), spine(turned), CHAIN)
    assert bent.shares_mm[:, 2] == pytest.approx(np.zeros(4), abs=1e-9)
    assert bent.shares_mm[:, 1] == pytest.approx(bent.shares_mm[:, 0], abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(seeds)
def test_the_parts_add_up_and_their_gradients_are_right(seed: int) -> None:
    rng = np.random.default_rng(seed)
    base = np.array([[0.0, 0, 75], [0, 0, 50], [0, 0, 25], [0, 0, 0]])
    before, after = base + rng.uniform(-6, 6, (2, 4, 3))
    found = displacement_shares(before, after, CHAIN)
    assert found.shares_mm[:, 0] == pytest.approx(-(after - after[3] - before + before[3])[:, 1])
    assert found.shares_mm[:, 1:].sum(axis=1) == pytest.approx(found.shares_mm[:, 0])
    step = rng.normal(0, 1e-5, (2, 4, 3))
    ahead, behind = (displacement_shares(before + s * step[0], after + s * step[1], CHAIN) for s in (1, -1))
    expected = (ahead.shares_mm - behind.shares_mm) / 2
    first = np.tensordot(found.before_gradient, step[0], 2) + np.tensordot(found.after_gradient, step[1], 2)
    assert np.allclose(first, expected, atol=1e-10)


def test_a_vertebra_without_a_way_has_no_shares() -> None:
    before = np.array([[np.nan] * 3, [0, 0, 25.0], [0, 0, 0]])
    shares = displacement_shares(before, before, [None, 2, None]).shares_mm
    assert np.isnan(shares[0]).all()
    assert shares[1] == pytest.approx([0, 0, 0])


def test_the_second_order_variance_is_that_of_the_product_of_two_errors() -> None:
    # Straight up without a change of length: the part of distraction is a product of two errors.
    straight = np.array([[0.0, 0, 75], [0, 0, 50], [0, 0, 25], [0, 0, 0]])
    factor = 0.5 * np.eye(12).reshape(4, 3, 12)
    zero = np.zeros_like(factor)
    both = [np.concatenate(pair, axis=2) for pair in ((factor, zero), (zero, factor))]
    rng = np.random.default_rng(0)
    found = [
        displacement_shares(
            straight + rng.normal(0, 0.5, (4, 3)), straight + rng.normal(0, 0.5, (4, 3)), CHAIN
        ).shares_mm[:, 2]
        for _ in range(3000)
    ]
    excess = distraction_excess(straight, straight, CHAIN, both[0], both[1])
    assert excess[3] == 0.0
    assert np.var(found, axis=0)[:3] == pytest.approx(excess[:3], rel=0.15)
    # One segment: var(l2 - l1) = 4 s^2, var((u1 + u2)/2) = s^2/l^2.
    assert excess[2] == pytest.approx(4 * 0.25 * 0.25 / 25**2)
