import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, camera_vector
from spinewatch.calibration.solve.conditioning import conditioned, unconditioned
from spinewatch.simulation.rigs import random_rig

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_the_coordinates_are_image_scale_and_perspective_of_the_centroid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera, centroid = random_rig(rng).left, rng.uniform((330, 300, 0), (530, 470, 150))
    y = conditioned(camera_vector(camera), centroid)
    ideal, _ = camera.pinhole.project(centroid)
    assert np.allclose(y[:2], ideal + camera.principal_point_mm)
    assert np.isclose(1 / y[2], camera.depth_mm(centroid))
    assert np.isclose(y[6], camera.focal_length_mm * y[2])
    assert np.array_equal(y[[3, 4, 5, *range(7, 14)]], camera_vector(camera)[[3, 4, 5, *range(7, 14)]])


@given(seeds, st.booleans())
def test_they_describe_the_same_camera_and_their_derivatives_are_right(seed: int, fixed: bool) -> None:
    rng = np.random.default_rng(seed)
    camera, centroid = random_rig(rng).left, rng.uniform((330, 300, 0), (530, 470, 150))
    vector = camera_vector(camera)
    focal = camera.focal_length_mm if fixed else None
    y = conditioned(vector, centroid)
    back, J = unconditioned(y, centroid, focal)
    assert np.abs(back - vector).max() < 1e-9
    for i, name in enumerate(PARAMETER_NAMES):
        h = 1e-6 * max(abs(y[i]), 1e-2)
        step = h * np.eye(len(y))[i]
        numeric = (
            unconditioned(y + step, centroid, focal)[0] - unconditioned(y - step, centroid, focal)[0]
        ) / (2 * h)
        assert np.abs(numeric - J[:, i]).max() < 1e-4 * max(1, np.abs(numeric).max()), name
