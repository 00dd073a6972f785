import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.points import Shot
from spinewatch.calibration.quality.accuracy import (
    calibration_accuracy,
    common_points,
    reconstruct,
    shot_accuracy,
)
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.simulation.rigs import random_rig
from tests.spinewatch.calibration.simulated import (
    SENSORS,
    TABLE_3_3,
    TYPICAL,
    image,
    moved_board,
    stereo_shot,
)

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_points_are_reconstructed_from_their_images(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig, X = random_rig(rng), rng.uniform((330, 300, 0), (530, 470, 150), (10, 3))
    assert np.allclose(reconstruct(rig, rig.left.project(X), rig.right.project(X)), X, atol=1e-6)


def test_common_points_are_matched_by_name() -> None:
    left = image(TABLE_3_3.left, ("9", "3", "12"))
    right = image(TABLE_3_3.right, ("12", "4", "9"))
    ids, control, left_px, right_px = common_points(Shot("1", left, right))
    assert ids == ("9", "12")
    assert np.array_equal(control, left.control_mm[[0, 2]])
    assert np.array_equal(left_px, left.pixels[[0, 2]])
    assert np.array_equal(right_px, right.pixels[[2, 0]])
    assert common_points(Shot("1", left, image(TABLE_3_3.right, ("4",))))[0] == ()


def test_the_motion_of_the_board_is_removed_unless_it_defines_object_space() -> None:
    shot = stereo_shot(placement=moved_board(1))
    removed = shot_accuracy(TABLE_3_3, shot, used=False, defines_object_space=False)
    assert np.abs(removed.residuals_mm).max() < 1e-6
    kept = shot_accuracy(TABLE_3_3, shot, used=False, defines_object_space=True)
    assert np.abs(kept.mean_mm).max() > 1


def test_too_few_common_points_have_no_residuals() -> None:
    accuracy = shot_accuracy(TABLE_3_3, stereo_shot(ids=TYPICAL[:2]), used=True, defines_object_space=True)
    assert accuracy.ids == ()
    assert np.all(np.isnan(accuracy.mean_mm))
    assert np.all(np.isnan(accuracy.sd_mm))


def test_residuals_of_shots_not_used_are_reported_separately_and_larger() -> None:
    used, fresh = [], []
    for seed in range(12):
        shot = stereo_shot(sigma_px=0.1, seed=seed)
        rig = calibrate_stereo([shot], SENSORS).rig
        accuracy = calibration_accuracy(rig, [shot], [stereo_shot("fresh", sigma_px=0.1, seed=seed + 100)])
        assert [a.used for a in accuracy] == [True, False]
        used.append(accuracy[0].sd_mm)
        fresh.append(accuracy[1].sd_mm)
    assert np.all(np.mean(fresh, axis=0) > np.mean(used, axis=0))


def test_depth_is_the_least_accurate_axis() -> None:
    shots = [stereo_shot(sigma_px=0.1, seed=seed) for seed in range(10)]
    sd = np.mean([a.sd_mm for a in calibration_accuracy(TABLE_3_3, shots)], axis=0)
    assert sd[2] > 1.5 * max(sd[:2])
    assert sd == pytest.approx([0.08, 0.08, 0.2], rel=0.5)
