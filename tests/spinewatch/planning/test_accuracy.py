import numpy as np
import pytest

from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.markers import FLAT_10_14_18, scaled
from spinewatch.planning.accuracy import best_marker, plan, predicted_poses, straight_row
from spinewatch.simulation.observations import Noise, observe
from spinewatch.simulation.rigs import converging_rig, large_rig
from spinewatch.simulation.scenes import aim_point
from spinewatch.triads.pose_fit import PoseParameters
from spinewatch.triads.search import SearchParameters, match_triads

LEVELS = ("L1", "T11", "T9")


def test_predictions_are_the_spread_of_measurements() -> None:
    rig = large_rig()
    row = straight_row(LEVELS, aim_point(rig), 50.0)
    predicted = predicted_poses(rig, FLAT_10_14_18, row, 0.1)
    parameters = SearchParameters(measure=PoseParameters(common_sd_mrad=0.0))
    scaled_errors = []
    for seed in range(80):
        seen = observe(rig, row, np.random.default_rng(seed), Noise(0.1))
        found = match_triads(seen.left, seen.right, rig, parameters, expected=3, axis="x").triads
        for triad, truth, pose in zip(found, row, predicted, strict=True):
            assert triad.pose is not None
            turn = np.degrees(vector_from_rotation(truth.rotation @ triad.pose.rotation.T))
            error = np.concatenate([truth.position_mm - triad.pose.position_mm, turn])
            scaled_errors.append(error / np.sqrt(np.diag(pose.covariance)))
    assert np.abs(np.std(scaled_errors, axis=0) - 1).max() < 0.15


def test_larger_triads_finer_sensors_and_less_noise_help_as_they_should() -> None:
    rig = large_rig()
    row = straight_row(LEVELS, aim_point(rig), 50.0)
    base = plan(rig, FLAT_10_14_18, LEVELS, row, 0.1)
    half = plan(rig, FLAT_10_14_18, LEVELS, row, 0.05)
    large = plan(rig, scaled(FLAT_10_14_18, 1.5), LEVELS, row, 0.1)
    fine = plan(converging_rig(420, 32, image_size_px=(1136, 832)), FLAT_10_14_18, LEVELS, row, 0.1)
    assert half.cobb_sd_deg == pytest.approx(base.cobb_sd_deg / 2)
    assert fine.cobb_sd_deg == pytest.approx(base.cobb_sd_deg / 2, rel=0.05)
    assert large.cobb_sd_deg == pytest.approx(base.cobb_sd_deg / 1.5, rel=0.02)
    assert np.isnan(base.triads[0].motion_sd_mm).all()
    assert base.triads[2].motion_sd_mm[2] > base.triads[1].motion_sd_mm[2]  # the reference's tilt has a lever
    assert all(triad.in_view for triad in base.triads)


def test_triads_outside_the_images_are_said_to_be() -> None:
    rig = large_rig()
    planned = plan(rig, FLAT_10_14_18, LEVELS, straight_row(LEVELS, aim_point(rig), 400.0), 0.1)
    assert [triad.in_view for triad in planned.triads] == [False, True, False]


def test_the_best_marker_in_a_disc_beats_the_thesis_one_and_fits() -> None:
    rig = large_rig()
    row = straight_row(("L1", "T9"), aim_point(rig), 80.0)
    marker = best_marker(rig, row, 0.1, 18.0)
    assert np.linalg.norm(marker.coordinates_mm, axis=1) == pytest.approx([18, 18, 18])
    assert np.diff(np.sort(marker.distances_mm)).min() >= 4
    old, new = (plan(rig, model, ("L1", "T9"), row, 0.1) for model in (FLAT_10_14_18, marker))
    assert new.triads[0].out_of_plane_sd_deg < 0.8 * old.triads[0].out_of_plane_sd_deg
    with pytest.raises(ParameterError, match="larger disc"):
        best_marker(rig, row, 0.1, 6.0)
