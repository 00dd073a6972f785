import subprocess
import sys

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.identification import distance_errors
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import Ball, Pose, ball_centres


def test_angles_and_deviations_are_about_the_stated_axes() -> None:
    R = rotation_from_vector(np.radians([0.0, 30.0, 0.0]))
    covariance = np.diag([1.0, 4.0, 9.0, 0.0, 0.0, 0.0])
    covariance[3:, 3:] = R @ np.diag([0.01, 0.04, 0.09]) @ R.T
    pose = Pose(np.zeros(3), R, covariance)
    assert np.allclose(pose.angles_deg, [60, 90, 30])
    assert np.allclose(pose.position_sd_mm, [1, 2, 3])
    assert np.allclose(pose.rotation_sd_deg, [0.1, 0.2, 0.3])


def test_poses_need_neither_opencv_nor_scipy() -> None:
    code = (
        "import sys, spinewatch.triads.pose, spinewatch.spine.motion, spinewatch.planning.marker_design;"
        "sys.exit(any(m in sys.modules for m in ('cv2', 'scipy')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@given(st.integers(0, 2**32 - 1))
def test_ball_centres_have_the_distances_of_the_marker(seed: int) -> None:
    poses = random_spine(np.random.default_rng(seed), 3)
    assert np.allclose(distance_errors(ball_centres(poses), FLAT_10_14_18), 0, atol=1e-9)


def test_the_image_of_a_ball_in_each_view() -> None:
    ball = Ball(np.zeros(3), np.eye(3), np.array([3.0, 4.0]), None, None)
    image = ball.image_px("left")
    assert image is not None
    assert image.tolist() == [3.0, 4.0]
    assert ball.image_px("right") is None
    assert ball.hidden_in == ("right",)
