"""Which centres are those of the same ball."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.detection.features import HIDDEN
from spinewatch.detection.refinement.duplicates import nearest, same_ball, without_duplicates

NONE = np.empty((0, 2))


def test_without_others_or_positions_there_is_no_nearest() -> None:
    assert nearest(np.zeros((2, 2)), NONE, 1.0).tolist() == [HIDDEN, HIDDEN]
    assert nearest(NONE, np.zeros((2, 2)), 1.0).tolist() == []


def test_a_position_at_the_radius_is_within_it() -> None:
    assert nearest(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([[0.0, 0.5]]), 0.5).tolist() == [0, HIDDEN]


@given(st.integers(0, 30), st.floats(0.05, 0.5))
def test_retained_positions_are_apart_and_every_other_has_a_retained_earlier_one(
    n: int, radius: float
) -> None:
    positions = np.random.default_rng(n).random((n, 2))
    kept = without_duplicates(positions, radius)
    distance = np.linalg.norm(positions[:, None] - positions, axis=2)
    for index in range(n):
        earlier = kept[kept < index]
        assert (index in kept) == bool(np.all(distance[index, earlier] > radius))


def test_the_size_of_a_ball_counts_along_each_axis() -> None:
    others = np.array([[11.9, 20.0], [10.0, 21.9]])
    assert same_ball(np.array([[10.0, 20.0]]), others, np.array([4.0, 5.0]), 0.4).tolist() == [[False, True]]
    assert same_ball(NONE, others, np.array([4.0, 5.0]), 0.4).shape == (0, 2)
