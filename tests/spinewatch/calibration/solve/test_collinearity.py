import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.calibration.solve.collinearity import (
    NAMES,
    camera_from_vector,
    camera_vector,
    project_with_derivatives,
)
from spinewatch.calibration.solve.conditioning import conditioned, unconditioned
from spinewatch.camera import Camera
from spinewatch.simulation.rigs import random_rig

seeds = st.integers(0, 2**32 - 1)
STEPS = np.array([1e-4] * 6 + [1e-5] * 3 + [1e-7] * 4 + [1e-6])


def scene(seed: int) -> tuple[Camera, Float]:
    rng = np.random.default_rng(seed)
    return random_rig(rng).left, rng.uniform((330, 300, 0), (530, 470, 150), (10, 3))


@given(seeds)
def test_the_analytic_derivatives_are_those_of_the_camera(seed: int) -> None:
    camera, points = scene(seed)
    pixels, by_parameter, by_point = project_with_derivatives(camera, points)
    assert np.abs(pixels - camera.project(points)).max() < 1e-9
    vector = camera_vector(camera)
    for i in range(len(NAMES)):
        step = np.zeros(len(NAMES))
        step[i] = STEPS[i]
        ends = [camera_from_vector(vector + s * step, camera).project(points) for s in (1, -1)]
        numeric = (ends[0] - ends[1]) / (2 * STEPS[i])
        assert np.abs(numeric - by_parameter[:, :, i]).max() < 1e-4 * max(1, np.abs(numeric).max()), NAMES[i]
    for k in range(3):
        step = 1e-4 * np.eye(3)[k]
        numeric = (camera.project(points + step) - camera.project(points - step)) / 2e-4
        assert np.abs(numeric - by_point[:, :, k]).max() < 1e-5


@given(seeds, st.booleans())
def test_conditioned_coordinates_describe_the_same_camera_and_their_derivatives_are_right(
    seed: int, fixed: bool
) -> None:
    camera, points = scene(seed)
    centroid, vector = points.mean(axis=0), camera_vector(camera)
    focal = camera.focal_length_mm if fixed else None
    y = conditioned(vector, centroid)
    back, J = unconditioned(y, centroid, focal)
    assert np.abs(back - vector).max() < 1e-9
    for i in range(len(y)):
        h = 1e-6 * max(abs(y[i]), 1e-2)
        step = h * np.eye(len(y))[i]
        numeric = (
            unconditioned(y + step, centroid, focal)[0] - unconditioned(y - step, centroid, focal)[0]
        ) / (2 * h)
        assert np.abs(numeric - J[:, i]).max() < 1e-4 * max(1, np.abs(numeric).max()), NAMES[i]
