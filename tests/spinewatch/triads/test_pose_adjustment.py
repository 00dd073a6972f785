from collections.abc import Sequence
from typing import Any

import numpy as np

from spinewatch.arrays import Float
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.geometry.transforms import fit_rigid
from spinewatch.geometry.triangulation import triangulate
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import Pose, ball_centres
from spinewatch.triads.pose_adjustment import (
    PoseAdjustment,
    PoseAdjustmentParameters,
    adjust_poses,
    triad_images,
)

MODEL = FLAT_10_14_18


def adjusted(poses: Sequence[Pose], rng: np.random.Generator, sigma: float) -> tuple[PoseAdjustment, Float]:
    rig, balls = large_rig(), ball_centres(poses).reshape(-1, 3)
    views = [
        camera.rays(
            camera.project(balls) + sigma * rng.standard_normal((len(balls), 2)),
            (max(sigma, 0.1) ** 2 * np.eye(2)),
        )
        for camera in (rig.left, rig.right)
    ]
    fits = [fit_rigid(MODEL.coordinates_mm, b) for b in triangulate(views).position_mm.reshape(-1, 3, 3)]
    R, P = np.stack([fit.rotation for fit in fits]), np.stack([fit.translation_mm for fit in fits])
    index = np.arange(len(balls)).reshape(-1, 3)
    return adjust_poses(MODEL.coordinates_mm, [triad_images(view, index) for view in views], P, R), R


def rotation_deg(R_true: Float, R: Any) -> Float:
    return np.degrees(vector_from_rotation(R_true @ R.T))


def test_exact_images_give_the_exact_pose() -> None:
    rng = np.random.default_rng(1)
    poses = random_spine(rng, 6)
    found, _ = adjusted(poses, rng, 0.0)
    for i, truth in enumerate(poses):
        pose = found.pose(i)
        assert np.allclose(pose.position_mm, truth.position_mm, atol=1e-6)
        assert np.linalg.norm(rotation_deg(truth.rotation, pose.rotation)) < 1e-5
    assert found.chi2.max() < 1e-9
    assert found.determined.all()
    assert set(found.dof) == {6}


def test_errors_fit_the_covariance_and_rotations_are_better_than_those_of_absolute_orientation() -> None:
    rng = np.random.default_rng(2)
    poses = [pose for _ in range(100) for pose in random_spine(rng, 6)]
    found, kabsch = adjusted(poses, rng, 0.2)
    rotation = np.array([rotation_deg(t.rotation, R) for t, R in zip(poses, found.rotation, strict=True)])
    before = np.array([rotation_deg(t.rotation, R) for t, R in zip(poses, kabsch, strict=True)])
    shift = np.array([t.position_mm for t in poses]) - found.position_mm
    e = np.concatenate([shift, rotation], axis=1)
    d = np.array([x @ np.linalg.solve(S, x) for x, S in zip(e, found.covariance, strict=True)])
    assert abs(d.mean() - 6) < 0.6
    assert 0.93 < (d < 12.59).mean() < 0.97  # the 95% quantile of chi2 with 6 degrees of freedom
    assert abs(found.chi2.mean() - 6) < 0.6
    assert np.sqrt((rotation**2).mean()) < 0.85 * np.sqrt((before**2).mean())


def test_balls_that_do_not_determine_a_pose_give_no_covariance() -> None:
    rig, rng = large_rig(), np.random.default_rng(3)
    pose = random_spine(rng, 1)[0]
    balls = ball_centres([pose]).reshape(-1, 3)
    hidden = np.array([[0, 1, HIDDEN]])
    views = []
    for camera in (rig.left, rig.right):
        features = Features.with_sigma(camera.project(balls), np.ones(3), 0.1)
        views.append(triad_images(features.rays(camera), hidden))
    found = adjust_poses(MODEL.coordinates_mm, views, pose.position_mm[None], pose.rotation[None])
    assert not found.determined[0]
    assert np.isnan(found.covariance).all()
    assert found.dof[0] == 2


def test_a_pose_is_not_rotated_about_a_held_axis() -> None:
    rng = np.random.default_rng(4)
    poses = random_spine(rng, 1)
    found, _ = adjusted(poses, rng, 0.1)
    rig, balls = large_rig(), ball_centres(poses).reshape(-1, 3)
    views = [
        triad_images(
            camera.rays(camera.project(balls), 0.1**2 * np.eye(2)),
            np.arange(3)[None],
        )
        for camera in (rig.left, rig.right)
    ]
    axis = np.array([[0.0, 0.6, 0.8]])
    start = rotation_from_vector(0.05 * axis[0]) @ poses[0].rotation
    free = adjust_poses(MODEL.coordinates_mm, views, found.position_mm, start[None])
    held = adjust_poses(MODEL.coordinates_mm, views, found.position_mm, start[None], held_axis=axis)
    assert np.linalg.norm(rotation_deg(poses[0].rotation, free.rotation[0])) < 1e-4
    assert abs(rotation_deg(start, held.rotation[0]) @ axis[0]) < 0.05
    assert held.chi2[0] > free.chi2[0] + 1


def test_the_number_of_steps_and_the_longest_step_are_parameters() -> None:
    rng = np.random.default_rng(5)
    poses = random_spine(rng, 1)
    rig, balls = large_rig(), ball_centres(poses).reshape(-1, 3)
    views = [
        triad_images(camera.rays(camera.project(balls), 0.1**2 * np.eye(2)), np.arange(3)[None])
        for camera in (rig.left, rig.right)
    ]
    start = rotation_from_vector(np.array([0.3, 0, 0])) @ poses[0].rotation

    def error(parameters: PoseAdjustmentParameters) -> float:
        found = adjust_poses(MODEL.coordinates_mm, views, poses[0].position_mm[None], start[None], parameters)
        return float(np.linalg.norm(rotation_deg(poses[0].rotation, found.rotation[0])))

    assert error(PoseAdjustmentParameters()) < 1e-5
    assert error(PoseAdjustmentParameters(max_steps=1)) > 0.01
    short = PoseAdjustmentParameters(max_steps=3, max_rotation_step_mrad=10.0)
    assert error(short) > np.degrees(0.3 - 0.031)


def test_repeated_images_are_those_of_the_triad() -> None:
    camera, rng = large_rig().left, np.random.default_rng(6)
    balls = ball_centres(random_spine(rng, 2)).reshape(-1, 3)
    index = np.array([[0, 1, 2], [3, HIDDEN, 5]])
    views = triad_images(camera.rays(camera.project(balls), 0.1**2 * np.eye(2)), index, 0.1)
    many = views.repeat(1, 4)
    assert many.ideal_mm.shape == (4, 3, 2)
    assert (many.ideal_mm == views.ideal_mm[1]).all()
    assert many.visible.tolist() == [[True, False, True]] * 4
    assert many.common_sd_mm == views.common_sd_mm == camera.focal_length_mm * 0.1 / 1000
