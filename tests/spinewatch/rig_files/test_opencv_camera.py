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
        (K.T, np.eye(3), "transposed"),
        (K + np.diag([0, 0, 1]), np.eye(3), "last row"),
        (K * [[1, 1, 2], [1, 1, 2], [1, 1, 1]], np.eye(3), "image size, such as 1200 x 800"),
        (K * [[0.01, 1, 1], [1, 0.01, 1], [1, 1, 1]], np.eye(3), "field of view"),
    ],
)
def test_cameras_outside_the_model_are_refused(
    matrix: np.ndarray, rotation: np.ndarray, problem: str
) -> None:
    with pytest.raises(RigError, match=problem):
        from_opencv(matrix, rotation, np.zeros(3), np.zeros(5), (600, 400))


@pytest.mark.parametrize(
    ("dist", "problem"),
    [
        ([-1.5, 0, 0, 0, 0], "fold"),
        ([0.3, -4.0, 0, 0], "fold"),
        ([0.1, 0, 0], "4, 5, 8, 12 or 14"),
        ([np.nan, 0, 0, 0], "finite"),
    ],
)
def test_distortions_without_an_inverse_are_refused(dist: list[float], problem: str) -> None:
    with pytest.raises(RigError, match=problem) as caught:
        from_opencv(K, np.eye(3), np.zeros(3), dist, (600, 400))
    assert caught.value.field == "dist"


@given(st.floats(-0.25, 0.25), st.floats(-0.05, 0.05))
def test_the_distortion_is_that_of_opencv_within_the_stated_error(k1: float, k2: float) -> None:
    dist = np.array([k1, k2, 1e-4, -1e-4])
    camera, error_px = from_opencv(K, np.diag([1.0, -1.0, -1.0]), np.zeros(3), dist, (600, 400))
    X = np.random.default_rng(0).uniform((-150, -100, -600), (150, 100, -500), (40, 3))
    t = np.zeros(3)
    image = cv2.projectPoints(X, cv2.Rodrigues(np.diag([1.0, -1.0, -1.0]))[0], t, K, dist)[0][:, 0]
    assert np.linalg.norm(camera.project(X) - image, axis=1).max() <= 1.5 * error_px + 1e-6
