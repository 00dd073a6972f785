import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.solve.orientation import (
    MIN_POSE_POINTS,
    from_opencv_pose,
    object_to_camera,
    opencv_directions,
    solve_pose,
    with_orientation,
)
from spinewatch.simulation.rigs import random_rig
from tests.spinewatch.calibration.simulated import FIELD, TABLE_3_3, TYPICAL, WIDE, image, parameter_error

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_the_motion_to_camera_space_is_that_of_the_collinearity_equations(seed: int) -> None:
    camera = random_rig(np.random.default_rng(seed)).right
    X = FIELD.points_mm
    assert np.allclose(object_to_camera(camera)(X), (X - camera.centre) @ camera.M.T)
    assert (
        parameter_error(with_orientation(TABLE_3_3.left, object_to_camera(TABLE_3_3.left)), TABLE_3_3.left)
        < 1e-9
    )


@given(seeds)
def test_the_interior_orientation_is_kept(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed))
    moved = with_orientation(rig.left, object_to_camera(rig.right))
    assert moved.radial == rig.left.radial
    assert moved.position_mm == pytest.approx(rig.right.position_mm)
    assert moved.rotation_deg == pytest.approx(rig.right.rotation_deg)


@pytest.mark.parametrize("ids", [TYPICAL, TYPICAL[:MIN_POSE_POINTS]])
def test_a_pose_is_solved_without_initial_values(ids: tuple[str, ...]) -> None:
    camera = TABLE_3_3.left
    pose = solve_pose(image(camera, ids), camera)
    true = object_to_camera(camera)
    assert np.allclose(pose.rotation, true.rotation, atol=1e-6)
    assert np.allclose(pose.translation_mm, true.translation_mm, atol=1e-3)


def test_two_points_determine_no_pose() -> None:
    with pytest.raises(ConvergenceError, match="no pose"):
        solve_pose(image(WIDE.left, TYPICAL[:2]), WIDE.left)


def test_directions_and_poses_of_opencv_have_y_down_and_z_forwards() -> None:
    camera, X = WIDE.left, FIELD.points_mm
    to_camera = object_to_camera(camera)
    flip = np.diag([1.0, -1.0, -1.0])
    R, t = flip @ to_camera.rotation, flip @ to_camera.translation_mm
    Xc = X @ R.T + t
    assert np.all(Xc[:, 2] > 0)
    assert np.allclose(opencv_directions(camera, camera.project(X)), Xc[:, :2] / Xc[:, 2:], atol=1e-9)
    assert np.allclose(from_opencv_pose(R, t).rotation, to_camera.rotation)
