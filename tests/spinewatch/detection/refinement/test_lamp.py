"""The lamp: where it should hang, and where its reflections in the balls of both views say that it does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.camera import Camera, Rig
from spinewatch.detection.refinement.lamp import Reflections, expected_lamp, measured_lamp
from spinewatch.simulation.rigs import table_3_3_rig

SD = 0.11
RANGE_MM = 700.0


def seen_from(camera: Camera, field: NDArray[np.float64], lamp: NDArray[np.float64]) -> NDArray[np.float64]:
    toward = camera.M @ (lamp - field)
    return np.asarray(toward[:2] * (1, -1) / np.linalg.norm(toward))


def reflections(
    camera: Camera, expected: NDArray[np.float64], true: NDArray[np.float64], sd: float, n: int
) -> Reflections:
    """Return what n balls say that each know the lamp to ``sd`` by themselves: a mean of that and the expectation."""
    own, prior = sd**-2, SD**-2
    word = (own * true + prior * expected) / (own + prior)
    return Reflections(camera, expected, np.tile(word, (n, 1)), np.full(n, (own + prior) ** -0.5))


def test_between_the_cameras_is_to_the_right_of_the_left_one_and_to_the_left_of_the_right_one() -> None:
    rig = table_3_3_rig()
    left, right = (expected_lamp(rig, camera, RANGE_MM) for camera in (rig.left, rig.right))
    assert left[0] == pytest.approx(-right[0], abs=0.02)
    assert 0.2 < left[0] < 0.4
    assert np.abs([left[1], right[1]]).max() < 0.03


@given(st.floats(-60, 60), st.floats(-60, 60))
def test_many_vague_balls_of_both_views_tell_a_displaced_lamp(along_mm: float, across_mm: float) -> None:
    rig = table_3_3_rig()
    field = rig.left.centre - RANGE_MM * rig.left.M[2]
    lamp = (rig.left.centre + rig.right.centre) / 2
    hung = lamp + np.array([along_mm, across_mm, 0])
    views = []
    for camera in (rig.left, rig.right):
        expected, true = (seen_from(camera, field, place) for place in (lamp, hung))
        views.append((reflections(camera, expected, true, 0.1, 200), true))
    found = measured_lamp([view for view, _ in views], SD)
    for place, (_, true) in zip(found, views, strict=True):
        assert place == pytest.approx(true, abs=0.006)


def shifted(rig: Rig, by: float) -> list[Reflections]:
    """Return what balls say whose centres are thought too near to the lamp, which so seems nearer to each axis."""
    views = []
    for camera in (rig.left, rig.right):
        expected = expected_lamp(rig, camera, RANGE_MM)
        views.append(reflections(camera, expected, expected * (1 - by), 0.05, 20))
    return views


def test_what_the_views_say_against_each_other_moves_no_lamp() -> None:
    rig = table_3_3_rig()
    views = shifted(rig, 0.2)
    for view, place in zip(views, measured_lamp(views, SD), strict=True):
        assert place == pytest.approx(view.expected, abs=0.004)


def test_without_balls_the_lamp_hangs_where_it_should() -> None:
    rig = table_3_3_rig()
    nothing = [
        Reflections(camera, expected_lamp(rig, camera, RANGE_MM), np.empty((0, 2)), np.empty(0))
        for camera in (rig.left, rig.right)
    ]
    for view, place in zip(nothing, measured_lamp(nothing, SD), strict=True):
        assert np.array_equal(place, view.expected)
