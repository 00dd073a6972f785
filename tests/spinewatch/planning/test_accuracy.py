import numpy as np
import pytest

from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.markers import FLAT_10_14_18, scaled
from spinewatch.planning.accuracy import expected_accuracy, expected_poses, straight_chain
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import convergence_point, converging_rig, large_rig
from spinewatch.triads.pose_fit import PoseParameters
from spinewatch.triads.search import SearchParameters, match_triads

LEVELS = ("L1", "T11", "T9")


def test_expected_deviations_are_the_spread_of_measurements() -> None:
    rig = large_rig()
    chain = straight_chain(LEVELS, convergence_point(rig), 50.0)
    expected = expected_poses(rig, FLAT_10_14_18, chain, 0.1)
    parameters = SearchParameters(pose=PoseParameters(common_sd_mrad=0.0))
    scaled_errors = []
    for seed in range(80):
        observation = observe(rig, chain, np.random.default_rng(seed), FeatureNoise(0.1))
        found = match_triads(
            observation.left, observation.right, rig, parameters, expected=3, axis="x"
        ).triads
        for triad, truth, pose in zip(found, chain, expected, strict=True):
            assert triad.pose is not None
            rotation = np.degrees(vector_from_rotation(truth.rotation @ triad.pose.rotation.T))
            error = np.concatenate([truth.position_mm - triad.pose.position_mm, rotation])
            scaled_errors.append(error / np.sqrt(np.diag(pose.covariance)))
    assert np.abs(np.std(scaled_errors, axis=0) - 1).max() < 0.15


def test_accuracy_scales_with_noise_marker_size_and_resolution() -> None:
    rig = large_rig()
    chain = straight_chain(LEVELS, convergence_point(rig), 50.0)
    base = expected_accuracy(rig, FLAT_10_14_18, LEVELS, chain, 0.1)
    half = expected_accuracy(rig, FLAT_10_14_18, LEVELS, chain, 0.05)
    large = expected_accuracy(rig, scaled(FLAT_10_14_18, 1.5), LEVELS, chain, 0.1)
    fine_rig = converging_rig(420, 32, image_size_px=(1136, 832))
    fine = expected_accuracy(fine_rig, FLAT_10_14_18, LEVELS, chain, 0.1)
    assert half.cobb_sd_deg == pytest.approx(base.cobb_sd_deg / 2)
    assert fine.cobb_sd_deg == pytest.approx(base.cobb_sd_deg / 2, rel=0.05)
    assert large.cobb_sd_deg == pytest.approx(base.cobb_sd_deg / 1.5, rel=0.02)
    assert np.isnan(base.triads[0].motion_sd_mm).all()
    # The displacement includes the tilt error of the reference, multiplied by the distance from it.
    assert base.triads[2].motion_sd_mm[2] > base.triads[1].motion_sd_mm[2]
    assert all(triad.in_view for triad in base.triads)


def test_a_shared_pointing_error_affects_positions_but_not_tilts() -> None:
    rig = large_rig()
    chain = straight_chain(LEVELS, convergence_point(rig), 50.0)
    own, shared = (
        expected_accuracy(rig, FLAT_10_14_18, LEVELS, chain, 0.1, common).triads[1] for common in (0.0, 0.5)
    )
    assert np.all(shared.position_sd_mm > 2 * own.position_sd_mm)
    assert shared.out_of_plane_sd_deg == pytest.approx(own.out_of_plane_sd_deg, rel=0.01)


def test_triads_outside_the_images_are_not_in_view() -> None:
    rig = large_rig()
    chain = straight_chain(LEVELS, convergence_point(rig), 400.0)
    expected = expected_accuracy(rig, FLAT_10_14_18, LEVELS, chain, 0.1)
    assert [triad.in_view for triad in expected.triads] == [False, True, False]


@pytest.mark.parametrize("axis", [0, 1])
def test_a_straight_chain_is_evenly_spaced_and_its_triads_point_along_it(axis: int) -> None:
    middle = np.array([434.0, 390.0, 90.0])
    chain = straight_chain(LEVELS, middle, 50.0, axis)
    positions = np.array([pose.position_mm for pose in chain])
    assert np.allclose(positions.mean(axis=0), middle)
    assert np.allclose(np.diff(positions, axis=0), 50 * np.eye(3)[axis])
    for pose in chain:
        assert np.allclose(pose.rotation[:, 0], np.eye(3)[axis])
        assert np.linalg.det(pose.rotation) == pytest.approx(1)
