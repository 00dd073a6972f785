from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.imaging.frame import Side
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig, table_3_3_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import MeasuredTriad, Pose, ball_centres
from spinewatch.triads.pose_fit import NO_POSE, PoseParameters, fit_poses
from spinewatch.triads.search import SearchParameters, match_triads

RIG, PARAMETERS = large_rig(), SearchParameters()
SIDES: tuple[Side, Side] = ("left", "right")


def fitted(
    pose: Pose, left: list[int], right: list[int], parameters: PoseParameters, sigma: float = 0.05
) -> MeasuredTriad:
    """The triad fitted to those of its three ball images that are not hidden."""
    balls = ball_centres([pose])[0]
    features = [
        Features.with_sigma(camera.project(balls), np.ones(3), sigma) for camera in (RIG.left, RIG.right)
    ]
    one = TriadCandidates(
        np.zeros(1, dtype=int),
        pose.position_mm[None] + 0.5,
        pose.rotation[None],
        np.zeros(1),
        np.array([[*left, HIDDEN]]),
        np.array([[*right, HIDDEN]]),
    )
    (triad,) = fit_poses(features[0], features[1], RIG, one, [FLAT_10_14_18], parameters)
    return triad


def true_pose(seed: int = 1) -> Pose:
    return random_spine(np.random.default_rng(seed), 1)[0]


def rotation_error_deg(truth: Pose, found: Pose) -> Float:
    return np.degrees(vector_from_rotation(truth.rotation @ found.rotation.T))


def test_exact_images_in_full_view_give_the_exact_triad() -> None:
    truth = true_pose()
    triad = fitted(truth, [0, 1, 2], [0, 1, 2], PoseParameters())
    assert triad.pose is not None
    assert np.allclose(triad.pose.position_mm, truth.position_mm, atol=1e-6)
    assert np.abs(rotation_error_deg(truth, triad.pose)).max() < 1e-5
    assert triad.error_mm < 1e-6
    assert triad.reason is None
    for ball, centre in zip(triad.balls.values(), ball_centres([truth])[0], strict=True):
        assert np.allclose(ball.position_mm, centre, atol=1e-6)
        assert ball.parallax_mm == pytest.approx(0, abs=1e-6)


def test_the_position_of_a_hidden_ball_follows_from_the_pose() -> None:
    truth = true_pose(2)
    triad = fitted(truth, [0, 1, 2], [0, HIDDEN, 2], PoseParameters())
    assert triad.pose is not None
    hidden = triad.balls["YY"]
    assert hidden.hidden_in == ("right",)
    offset = hidden.position_mm - triad.pose.position_mm
    assert np.allclose(triad.pose.rotation.T @ offset, FLAT_10_14_18.coordinates_mm[1], atol=1e-9)
    visible = triad.balls["XX"]
    assert np.trace(hidden.covariance_mm2) > np.trace(visible.covariance_mm2)


def test_two_balls_alone_give_balls_and_no_pose() -> None:
    triad = fitted(true_pose(3), [0, HIDDEN, 2], [0, HIDDEN, 2], PoseParameters())
    assert triad.pose is None
    assert triad.reason == NO_POSE
    assert list(triad.balls) == ["XX", "MX"]
    assert triad.error_mm < 1e-6


def test_a_pose_that_is_not_certain_enough_is_none() -> None:
    loose, strict = (
        fitted(true_pose(4), [0, 1, 2], [0, HIDDEN, 2], PoseParameters(max_rotation_sd_deg=limit))
        for limit in (15.0, 0.1)
    )
    assert loose.pose is not None
    assert strict.pose is None
    assert strict.reason == NO_POSE


def test_an_error_that_the_balls_share_widens_the_position_and_hardly_the_rotation() -> None:
    rig, rng = table_3_3_rig(), np.random.default_rng(10)
    observed = observe(rig, random_spine(rng, 1), rng, FeatureNoise(0.1))
    narrow, wide = (
        match_triads(
            observed.left,
            observed.right,
            rig,
            replace(PARAMETERS, pose=PoseParameters(common_sd_mrad=sd)),
            expected=1,
        )
        .triads[0]
        .pose
        for sd in (0.0, 0.13)
    )
    assert narrow is not None
    assert wide is not None
    assert np.allclose(wide.rotation_sd_deg, narrow.rotation_sd_deg, rtol=0.05)
    # Twin errors of 0.13 mrad at 0.7 m and 32 degrees of convergence are some 0.2 mm of height.
    assert 0.15 < np.sqrt(wide.covariance[2, 2] - narrow.covariance[2, 2]) < 0.3


@pytest.mark.parametrize("common_sd_mrad", [0.0, 0.06])
def test_stated_uncertainties_hold_for_triads_in_full_view_and_occluded_ones(common_sd_mrad: float) -> None:
    rig = large_rig()
    parameters = replace(PARAMETERS, pose=PoseParameters(common_sd_mrad=common_sd_mrad))
    chi2: dict[bool, list[float]] = {False: [], True: []}
    posed = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        poses = random_spine(rng, 3)
        hidden = (int(rng.integers(9)), SIDES[seed % 2])
        observed = observe(rig, poses, rng, FeatureNoise(0.1, common_sd_mrad, 10), hidden=[hidden])
        search = match_triads(observed.left, observed.right, rig, parameters, expected=3, axis="x")
        for triad in search.triads:
            if triad.pose is None:
                continue
            nearest = min(poses, key=lambda p: float(np.linalg.norm(p.position_mm - triad.position_mm)))
            e = nearest.position_mm - triad.pose.position_mm
            occluded = any(ball.hidden_in for ball in triad.balls.values())
            posed += occluded
            chi2[occluded].append(float(e @ np.linalg.solve(triad.pose.covariance[:3, :3], e)))
            rotation = np.degrees(vector_from_rotation(nearest.rotation @ triad.pose.rotation.T))
            chi2[occluded].append(float(rotation @ np.linalg.solve(triad.pose.covariance[3:, 3:], rotation)))
    assert posed >= 142
    for values in chi2.values():
        assert 0.91 < np.mean(np.array(values) < 7.815) < 0.98  # the 95% quantile, 3 degrees of freedom
