"""Poses as arrays, and means on the sphere of rotations."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.tracking.pose_series import mean_rotation, pose_series
from spinewatch.triads.pose import Pose

VECTOR = st.lists(st.floats(-0.4, 0.4), min_size=3, max_size=3)


def at(x: float, angle_deg: float = 0.0) -> Pose:
    rotation = rotation_from_vector(np.radians([0.0, 0.0, angle_deg]))
    return Pose(np.array([x, 0.0, 0.0]), rotation, np.eye(6))


@given(st.lists(VECTOR, min_size=1, max_size=6), VECTOR)
def test_rotation_vectors_from_the_mean_have_the_sum_zero(
    turns: list[list[float]], base: list[float]
) -> None:
    R = rotation_from_vector(np.array(turns)) @ rotation_from_vector(np.array(base))
    mean = mean_rotation(R)
    assert np.allclose(vector_from_rotation(R @ mean.T).sum(axis=0), 0, atol=1e-6)
    assert np.allclose(mean @ mean.T, np.eye(3))


def test_deviations_are_about_the_object_axes_in_degrees() -> None:
    series = pose_series([{"L1": at(0, 10)}, {"T9": at(5)}, {"L1": at(4, 20)}])
    assert series.labels == ("L1", "T9")
    assert series.present.tolist() == [[True, False, True], [False, True, False]]
    assert np.allclose(series.position_mm, [[2, 0, 0], [5, 0, 0]])
    assert np.allclose(series.deviation[0], [[-2, 0, 0, 0, 0, -5], [0] * 6, [2, 0, 0, 0, 0, 5]])


def test_a_deviation_makes_the_pose_again() -> None:
    pairs = [{"L1": at(0, 10)}, {"L1": at(4, 30)}]
    series = pose_series(pairs)
    for k, pair in enumerate(pairs):
        again = series.pose(0, series.deviation[0, k], np.eye(6))
        assert np.allclose(again.position_mm, pair["L1"].position_mm)
        assert np.allclose(again.rotation, pair["L1"].rotation)
