import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.calibration.solve.collinearity import (
    PARAMETER_NAMES,
    camera_from_vector,
    camera_vector,
    project_with_derivatives,
    rotation_axes,
)
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.simulation.rigs import random_rig

seeds = st.integers(0, 2**32 - 1)
STEPS = np.array([1e-4] * 6 + [1e-5] * 3 + [1e-7] * 4 + [1e-6])


def scene(seed: int) -> tuple[Camera, Float]:
    rng = np.random.default_rng(seed)
    return random_rig(rng).left, rng.uniform((330, 300, 0), (530, 470, 150), (10, 3))


@given(seeds)
def test_a_vector_describes_the_same_camera(seed: int) -> None:
    camera, _ = scene(seed)
    again = camera_from_vector(camera_vector(camera), camera)
    assert np.array_equal(camera_vector(again), camera_vector(camera))
    assert again.image_size_px == camera.image_size_px
    assert again.pixel_size_mm == pytest.approx(camera.pixel_size_mm)


@given(seeds)
def test_the_analytic_derivatives_are_those_of_the_camera(seed: int) -> None:
    camera, points = scene(seed)
    pixels, by_parameter, by_point = project_with_derivatives(camera, points)
    assert np.abs(pixels - camera.project(points)).max() < 1e-9
    vector = camera_vector(camera)
    for i in range(len(PARAMETER_NAMES)):
        step = np.zeros(len(PARAMETER_NAMES))
        step[i] = STEPS[i]
        ends = [camera_from_vector(vector + s * step, camera).project(points) for s in (1, -1)]
        numeric = (ends[0] - ends[1]) / (2 * STEPS[i])
        bound = 1e-4 * max(1, np.abs(numeric).max())
        assert np.abs(numeric - by_parameter[:, :, i]).max() < bound, PARAMETER_NAMES[i]
    for k in range(3):
        step = 1e-4 * np.eye(3)[k]
        numeric = (camera.project(points + step) - camera.project(points - step)) / 2e-4
        assert np.abs(numeric - by_point[:, :, k]).max() < 1e-5


@given(seeds)
def test_points_behind_the_camera_have_no_image(seed: int) -> None:
    camera, points = scene(seed)
    mirrored = 2 * camera.centre - points
    pixels, by_parameter, by_point = project_with_derivatives(camera, np.concatenate([points, mirrored]))
    assert np.all(np.isfinite(pixels[:10]))
    assert np.all(np.isnan(pixels[10:]))
    assert np.all(np.isnan(by_point[10:]))
    assert np.all(np.isnan(by_parameter[10:, :, :6]))


@given(st.lists(st.floats(-80, 80), min_size=3, max_size=3))
def test_rotation_axes_are_those_of_small_changes_of_the_angles(angles: list[float]) -> None:
    v = np.array([0.3, -0.7, 0.5])
    rotation = np.array(angles)
    for i, axis in enumerate(rotation_axes(rotation)):
        step = 1e-4 * np.eye(3)[i]
        ends = [rotation_from_angles(*(rotation + s * step)) @ v for s in (1, -1)]
        numeric = (ends[0] - ends[1]) / (2 * np.radians(1e-4))
        assert np.allclose(numeric, np.cross(rotation_from_angles(*rotation) @ v, axis), atol=1e-8)
