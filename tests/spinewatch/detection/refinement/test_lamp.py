"""The lamp: its expected direction, and the one estimated from its reflections in the balls of both views."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.camera import Camera, Rig
from spinewatch.detection.refinement.lamp import LampEstimates, estimate_lamp, expected_lamp
from spinewatch.simulation.rigs import table_3_3_rig

SD = 0.11
RANGE_MM = 700.0


def direction_from(
    camera: Camera, field: NDArray[np.float64], lamp: NDArray[np.float64]
) -> NDArray[np.float64]:
    toward = camera.M @ (lamp - field)
    return np.asarray(toward[:2] * (1, -1) / np.linalg.norm(toward))


def estimates(
    camera: Camera, expected: NDArray[np.float64], true: NDArray[np.float64], sd: float, n: int
) -> LampEstimates:
    """Return the estimates of n balls, each the mean of its own of standard deviation ``sd`` and the expectation."""
    own, prior = sd**-2, SD**-2
    mean = (own * true + prior * expected) / (own + prior)
    return LampEstimates(camera, expected, np.tile(mean, (n, 1)), np.full(n, (own + prior) ** -0.5))


def test_between_the_cameras_is_to_the_right_of_the_left_one_and_to_the_left_of_the_right_one() -> None:
    rig = table_3_3_rig()
    left, right = (expected_lamp(rig, camera, RANGE_MM) for camera in (rig.left, rig.right))
    assert left[0] == pytest.approx(-right[0], abs=0.02)
    assert 0.2 < left[0] < 0.4
    assert np.abs([left[1], right[1]]).max() < 0.03


@given(st.floats(-60, 60), st.floats(-60, 60))
def test_many_inaccurate_balls_of_both_views_give_a_displaced_lamp(along_mm: float, across_mm: float) -> None:
    rig = table_3_3_rig()
    field = rig.left.centre - RANGE_MM * rig.left.M[2]
    lamp = (rig.left.centre + rig.right.centre) / 2
    actual = lamp + np.array([along_mm, across_mm, 0])
    views = []
    for camera in (rig.left, rig.right):
        expected, true = (direction_from(camera, field, direction) for direction in (lamp, actual))
        views.append((estimates(camera, expected, true, 0.1, 200), true))
    found = estimate_lamp([view for view, _ in views], SD)
    for direction, (_, true) in zip(found, views, strict=True):
        assert direction == pytest.approx(true, abs=0.006)


def shifted(rig: Rig, by: float) -> list[LampEstimates]:
    """Return estimates of balls whose centres are in error towards the lamp, which then appears nearer to each axis."""
    views = []
    for camera in (rig.left, rig.right):
        expected = expected_lamp(rig, camera, RANGE_MM)
        views.append(estimates(camera, expected, expected * (1 - by), 0.05, 20))
    return views


def test_opposite_displacements_in_the_views_cancel() -> None:
    rig = table_3_3_rig()
    views = shifted(rig, 0.2)
    for view, direction in zip(views, estimate_lamp(views, SD), strict=True):
        assert direction == pytest.approx(view.expected, abs=0.004)


def test_without_balls_the_lamp_is_the_expected_one() -> None:
    rig = table_3_3_rig()
    nothing = [
        LampEstimates(camera, expected_lamp(rig, camera, RANGE_MM), np.empty((0, 2)), np.empty(0))
        for camera in (rig.left, rig.right)
    ]
    for view, direction in zip(nothing, estimate_lamp(nothing, SD), strict=True):
        assert np.array_equal(direction, view.expected)
