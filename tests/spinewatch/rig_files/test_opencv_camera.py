import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.solve.collinearity import camera_vector
from spinewatch.errors import RigError
from spinewatch.rig_files.opencv_camera import from_opencv, to_opencv
from spinewatch.simulation.rigs import random_rig, table_3_3_rig


@given(st.integers(0, 2**32 - 1))
def test_opencv_projects_as_the_camera_does_within_the_stated_error(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = random_rig(rng).left
    exported = to_opencv(camera)
    X = camera.centre + rng.uniform(500, 900, (30, 1)) * camera.directions(
        rng.uniform((0, 0), (567, 415), (30, 2))
    )
    image, _ = cv2.projectPoints(X, cv2.Rodrigues(exported.R)[0], exported.t, exported.K, exported.dist)
    miss = np.linalg.norm(image[:, 0] - camera.project(X), axis=1)
    assert miss.max() <= 1.5 * exported.fit_error_px + 1e-6


def test_there_and_back_is_the_same_camera() -> None:
    camera = table_3_3_rig().left
    o = to_opencv(camera)
    back, error_px = from_opencv(o.K, o.R, o.t, o.dist, camera.image_size_px)
    assert error_px < 0.005
    assert np.abs(camera_vector(back) - camera_vector(camera)).max() < 1e-4


def test_what_opencv_may_say_and_we_cannot_is_refused() -> None:
    K = np.array([[800.0, 0, 300], [0, 800, 200], [0, 0, 1]])
    with pytest.raises(RigError, match="rotation"):
        from_opencv(K, 2 * np.eye(3), np.zeros(3), np.zeros(5), (600, 400))
    K[0, 1] = 3
    with pytest.raises(RigError, match="skew"):
        from_opencv(K, np.eye(3), np.zeros(3), np.zeros(5), (600, 400))
