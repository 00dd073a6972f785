import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.triads.model import FLAT_10_14_18
from spinewatch.triads.pose import (
    DegenerateTriadError,
    Pose,
    absolute_orientation,
    kabsch_pose,
    rotation_from_vector,
    rough_pose,
    vector_from_rotation,
)

MODEL = FLAT_10_14_18.coordinates_mm
seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_any_pose_is_recovered_from_its_balls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = Rotation.random(5, rng=rng).as_matrix()
    P = rng.uniform(-500, 500, (5, 3))
    balls = P[:, None] + MODEL @ np.swapaxes(R, -1, -2)
    found_R, found_P = absolute_orientation(MODEL, balls)
    assert np.allclose(found_R, R, atol=1e-9)
    assert np.allclose(found_P, P, atol=1e-9)
    assert np.allclose(np.linalg.det(found_R), 1)
    thesis_P, thesis_R = rough_pose(MODEL, balls)
    assert np.allclose(thesis_P, P, atol=1e-9)
    assert np.allclose(thesis_R, R, atol=1e-9)


def test_noisy_balls_never_give_a_reflection() -> None:
    rng = np.random.default_rng(0)
    balls = MODEL + rng.normal(0, 2, (500, 3, 3))
    R, _ = absolute_orientation(MODEL, balls)
    assert np.allclose(np.linalg.det(R), 1)


def test_balls_on_a_line_have_no_orientation() -> None:
    with pytest.raises(DegenerateTriadError):
        absolute_orientation(MODEL, np.outer([0.0, 10.0, 28.0], [1.0, 2.0, 2.0]))


def test_the_closed_form_covariance_is_calibrated() -> None:
    rng = np.random.default_rng(11)
    R = rotation_from_vector(np.array([0.2, -0.3, 1.0]))
    truth = np.array([400.0, 380.0, 90.0]) + MODEL @ R.T
    A = rng.normal(0, 0.25, (3, 3, 3))
    S = A @ np.swapaxes(A, -1, -2) + 0.02 * np.eye(3)
    L = np.linalg.cholesky(S)
    chi2 = []
    for _ in range(1500):
        pose = kabsch_pose(MODEL, truth + (L @ rng.standard_normal((3, 3, 1)))[..., 0], S)
        theta = np.degrees(vector_from_rotation(R @ pose.rotation.T))
        e = np.concatenate([[400.0, 380.0, 90.0] - pose.position_mm, theta])
        chi2.append(e @ np.linalg.solve(pose.covariance, e))
    assert abs(np.mean(chi2) - 6) < 0.5


@given(st.lists(st.floats(-1.8, 1.8), min_size=3, max_size=3))
def test_rotation_vectors_agree_with_scipy(vector: list[float]) -> None:
    v = np.array(vector)
    R = rotation_from_vector(v)
    assert np.allclose(R, Rotation.from_rotvec(v).as_matrix(), atol=1e-12)
    assert np.allclose(rotation_from_vector(vector_from_rotation(R)), R, atol=1e-12)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8], [-0.48, 0.64, 0.6]])
@pytest.mark.parametrize("angle", [1e-9, 1.0, np.pi - 1e-9])
def test_rotation_vectors_keep_their_digits_at_the_ends(axis: Any, angle: float) -> None:
    v = angle * np.array(axis)
    assert np.allclose(vector_from_rotation(Rotation.from_rotvec(v).as_matrix()), v, rtol=1e-6, atol=1e-15)


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
        "import sys, spinewatch.triads.pose, spinewatch.spine.motion;"
        "sys.exit(any(m in sys.modules for m in ('cv2', 'scipy')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
