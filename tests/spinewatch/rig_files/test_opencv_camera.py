import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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
    error = np.linalg.norm(image[:, 0] - camera.project(X), axis=1)
    assert error.max() <= 1.5 * exported.fit_error_px + 1e-6


def test_round_trip_returns_the_camera() -> None:
    camera = table_3_3_rig().left
    o = to_opencv(camera)
    back, error_px = from_opencv(o.K, o.R, o.t, o.dist, camera.image_size_px)
    assert error_px < 0.005
    assert back.image_size_px == camera.image_size_px
    for name in ("position_mm", "rotation_deg", "focal_length_mm", "principal_point_mm", "pixel_size_mm"):
        assert getattr(back, name) == pytest.approx(getattr(camera, name), abs=1e-9), name
    assert back.radial == pytest.approx(camera.radial, abs=1e-4)
    assert back.decentering == pytest.approx(camera.decentering, abs=1e-5)


def test_the_scale_of_the_plate_follows_the_pixel_width() -> None:
    camera = table_3_3_rig().left
    o = to_opencv(camera)
    back, _ = from_opencv(o.K, o.R, o.t, o.dist, camera.image_size_px, pixel_width_mm=0.02)
    assert back.focal_length_mm == pytest.approx(2 * camera.focal_length_mm)
    X = np.array([[434.0, 390.0, 60.0], [400.0, 420.0, 100.0]])
    assert np.abs(back.project(X) - camera.project(X)).max() < 0.005


K = np.array([[800.0, 0, 300], [0, 800, 200], [0, 0, 1]])
SKEWED = np.array([[800.0, 3, 300], [0, 800, 200], [0, 0, 1]])


@pytest.mark.parametrize(
    ("matrix", "rotation", "problem"),
    [
        (K, 2 * np.eye(3), "rotation"),
        (K, np.diag([1.0, 1.0, -1.0]), "rotation"),
        (SKEWED, np.eye(3), "skew"),
        (K * np.nan, np.eye(3), "finite"),
        (-K, np.eye(3), "positive"),
        (K[:2], np.eye(3), "3 x 3"),
    ],
)
def test_cameras_outside_the_model_are_refused(
    matrix: np.ndarray, rotation: np.ndarray, problem: str
) -> None:
    with pytest.raises(RigError, match=problem):
        from_opencv(matrix, rotation, np.zeros(3), np.zeros(5), (600, 400))
