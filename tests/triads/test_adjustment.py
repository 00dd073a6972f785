from collections.abc import Sequence
from typing import Any

import numpy as np

from spinewatch.camera import Float
from spinewatch.correspondence.intersection import intersect
from spinewatch.correspondence.rays import feature_rays
from spinewatch.features import Features
from spinewatch.simulation.observations import ball_centres
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.adjustment import adjust_poses
from spinewatch.triads.model import FLAT_10_14_18
from spinewatch.triads.pose import Pose, absolute_orientation, vector_from_rotation

MODEL = FLAT_10_14_18


def adjusted(
    poses: Sequence[Pose], rng: np.random.Generator, sigma: float
) -> tuple[tuple[tuple[Pose, ...], Float], Float]:
    rig, balls = large_rig(), ball_centres(poses).reshape(-1, 3)
    views = [
        feature_rays(
            camera,
            Features.with_sigma(
                camera.project(balls) + sigma * rng.standard_normal((len(balls), 2)),
                np.ones(len(balls)),
                max(sigma, 0.1),
            ),
        )
        for camera in (rig.left, rig.right)
    ]
    R, P = absolute_orientation(MODEL.coordinates_mm, intersect(views).position_mm.reshape(-1, 3, 3))
    return adjust_poses(MODEL, views, P, R), R


def turn_deg(R_true: Float, R: Any) -> Float:
    return np.degrees(vector_from_rotation(R_true @ R.T))


def test_exact_images_give_the_exact_pose() -> None:
    rng = np.random.default_rng(1)
    poses = random_spine(rng, 6)
    (found, chi2), _ = adjusted(poses, rng, 0.0)
    for pose, truth in zip(found, poses, strict=True):
        assert np.allclose(pose.position_mm, truth.position_mm, atol=1e-6)
        assert np.linalg.norm(turn_deg(truth.rotation, pose.rotation)) < 1e-5
    assert chi2.max() < 1e-9


def test_covariance_is_calibrated_and_rotations_beat_absolute_orientation() -> None:
    rng = np.random.default_rng(2)
    poses = [pose for _ in range(100) for pose in random_spine(rng, 6)]
    (found, chi2), kabsch = adjusted(poses, rng, 0.2)
    rotation = np.array([turn_deg(t.rotation, p.rotation) for t, p in zip(poses, found, strict=True)])
    before = np.array([turn_deg(t.rotation, R) for t, R in zip(poses, kabsch, strict=True)])
    shift = np.array([t.position_mm - p.position_mm for t, p in zip(poses, found, strict=True)])
    e = np.concatenate([shift, rotation], axis=1)
    d = np.array([x @ np.linalg.solve(p.covariance, x) for x, p in zip(e, found, strict=True)])
    assert abs(d.mean() - 6) < 0.6
    assert 0.93 < (d < 12.59).mean() < 0.97  # the 95% quantile of chi2 with 6 degrees of freedom
    assert abs(chi2.mean() - 6) < 0.6
    assert np.sqrt((rotation**2).mean()) < 0.85 * np.sqrt((before**2).mean())
