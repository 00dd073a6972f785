from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.detection.features import HIDDEN
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import Pose, ball_centres
from spinewatch.triads.pose_adjustment import TriadImages, adjust_poses, triad_images
from spinewatch.triads.twist import TiltPrior, TwistParameters, average_over_twist, mean_pose

MODEL, RIG, PARAMETERS = FLAT_10_14_18.coordinates_mm, large_rig(), TwistParameters()
AXIS_BALLS = (0, 2)
VIEWING = TiltPrior(np.array([0.0, 0, 1]), 18.0)


def images_without(ball: int, truth: Pose, sigma_px: float = 0.1) -> list[TriadImages]:
    """Exact images of a triad; the right camera does not show one ball."""
    balls = ball_centres([truth])[0]
    index = np.arange(3)[None]
    hidden = np.where(index == ball, HIDDEN, index)
    return [
        triad_images(camera.rays(camera.project(balls), sigma_px**2 * np.eye(2)), i)
        for camera, i in ((RIG.left, index), (RIG.right, hidden))
    ]


def occluded(seed: int) -> tuple[Pose, list[TriadImages], Pose]:
    truth = random_spine(np.random.default_rng(seed), 1)[0]
    images = images_without(1, truth)
    fit = adjust_poses(MODEL, images, truth.position_mm[None], truth.rotation[None])
    return truth, images, fit.pose(0)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_truth_is_within_the_stated_deviations(seed: int) -> None:
    truth, images, initial = occluded(seed)
    found = average_over_twist(MODEL, images, initial, AXIS_BALLS, VIEWING, PARAMETERS)
    error = np.degrees(vector_from_rotation(truth.rotation @ found.rotation.T))
    S = found.covariance[3:, 3:]
    assert error @ np.linalg.solve(S, error) < 16.3  # one in a thousand, 3 degrees of freedom
    assert np.linalg.eigvalsh(found.covariance)[0] > 0


def test_the_mean_is_less_certain_than_the_curvature_at_the_maximum() -> None:
    _, images, initial = occluded(3)
    found = average_over_twist(MODEL, images, initial, AXIS_BALLS, VIEWING, PARAMETERS)
    assert found.rotation_sd_deg.max() > 0.99 * initial.rotation_sd_deg.max()


@pytest.mark.parametrize("n", [37, 145])
def test_the_number_of_samples_changes_the_moments_hardly(n: int) -> None:
    _, images, initial = occluded(4)
    usual, other = (
        average_over_twist(MODEL, images, initial, AXIS_BALLS, VIEWING, replace(PARAMETERS, n_samples=count))
        for count in (73, n)
    )
    assert np.allclose(usual.position_mm, other.position_mm, atol=0.01)
    assert np.allclose(usual.rotation_sd_deg, other.rotation_sd_deg, rtol=0.05)


def test_a_narrow_prior_determines_the_tilt() -> None:
    truth, images, initial = occluded(5)
    prior = TiltPrior(truth.normal, 0.2)
    wide, narrow = (
        average_over_twist(MODEL, images, initial, AXIS_BALLS, tilt, PARAMETERS) for tilt in (VIEWING, prior)
    )
    assert narrow.rotation_sd_deg.max() < wide.rotation_sd_deg.max()
    assert np.linalg.norm(np.cross(narrow.normal, truth.normal)) < np.sin(np.radians(0.5))


def test_the_prior_is_normal_in_the_tilt_and_uniform_about_z() -> None:
    prior = TiltPrior(np.array([0.0, 0, 5]), 10.0)
    angles = np.radians(np.array([[0.0, 0, 0], [0, 0, 70], [10, 0, 0], [0, 20, 0]]))
    assert np.allclose(prior.log_density(rotation_from_vector(angles)), [0, 0, -0.5, -2], atol=1e-9)


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_mean_of_equal_poses_is_the_pose(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = rotation_from_vector(rng.normal(size=3))
    A = rng.normal(size=(6, 6))
    weight = rng.uniform(0.1, 1, 5)
    P = rng.normal(size=3) * 100
    found = mean_pose(
        np.tile(P, (5, 1)), np.tile(R, (5, 1, 1)), np.tile(A @ A.T, (5, 1, 1)), weight / weight.sum()
    )
    assert np.allclose(found.position_mm, P)
    assert np.allclose(found.rotation, R, atol=1e-12)
    assert np.allclose(found.covariance, A @ A.T)


def test_the_scatter_of_poses_is_part_of_the_covariance() -> None:
    angle = np.radians(3.0)
    R = rotation_from_vector(np.array([[angle, 0, 0], [-angle, 0, 0]]))
    found = mean_pose(np.zeros((2, 3)), R, np.zeros((2, 6, 6)), np.array([0.5, 0.5]))
    assert np.allclose(found.rotation, np.eye(3), atol=1e-12)
    assert found.rotation_sd_deg == pytest.approx([3, 0, 0], abs=1e-9)
