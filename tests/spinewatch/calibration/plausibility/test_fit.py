from dataclasses import replace

import numpy as np
import pytest

from spinewatch.calibration.plausibility.fit import baseline_sd_mm, fit_doubts, fit_limits
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import Sensor, Shot
from spinewatch.calibration.quality.rig_samples import sample_rigs
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import StereoCalibration, calibrate_stereo
from tests.spinewatch.calibration.simulated import SENSORS, moved_board, stereo_shot

PARAMETERS = CalibrationLimits()


def solved(shot: Shot, sensors: tuple[Sensor, Sensor] = SENSORS) -> StereoCalibration:
    return calibrate_stereo([shot], sensors)


def test_the_deviation_of_the_baseline_is_that_of_rigs_drawn_from_the_covariance() -> None:
    adjustment = solved(stereo_shot(sigma_px=0.05)).adjustment
    samples = [r.baseline_mm for r in sample_rigs(adjustment, 2000, np.random.default_rng(1))]
    assert baseline_sd_mm(adjustment) == pytest.approx(np.std(samples), rel=0.1)


def test_a_sound_fit_has_no_doubts_and_limits_refuse_or_flag() -> None:
    calibration = solved(stereo_shot(sigma_px=0.05))
    fit = (calibration.rig, calibration.shots, calibration.adjustment)
    doubts = fit_doubts(*fit, PARAMETERS)
    assert not doubts.refused
    assert not doubts.flagged
    share = baseline_sd_mm(calibration.adjustment) / calibration.rig.baseline_mm
    flagged = fit_doubts(*fit, replace(PARAMETERS, baseline_sd=2 * share))
    assert not flagged.refused
    assert "baseline 42" in flagged.flagged[0]
    refused = fit_doubts(*fit, replace(PARAMETERS, baseline_sd=share / 2, residual_of_field=1e-6))
    assert len(refused.refused) == 2


def test_the_limits_of_a_fit_grow_with_baseline_and_field() -> None:
    calibration = solved(stereo_shot(sigma_px=0.05))
    limits = fit_limits(calibration.rig, calibration.shots, PARAMETERS)
    assert limits.rms_px == PARAMETERS.rms_px
    assert limits.baseline_sd_mm[1] == pytest.approx(0.05 * calibration.rig.baseline_mm)
    control = np.concatenate([image.control_mm for image in calibration.shots[0].images])
    assert limits.reconstruction_mm[1] == pytest.approx(0.01 * np.linalg.norm(np.ptp(control, axis=0)))
    for flagged, refused in (limits.baseline_sd_mm, limits.reconstruction_mm):
        assert flagged == pytest.approx(PARAMETERS.doubtful * refused)


def test_several_shots_are_refused_by_their_residuals_against_those_of_each_camera() -> None:
    late = stereo_shot("B", placement=moved_board(2))
    mixed = Shot("B", stereo_shot("B", placement=moved_board(3, 0.3, 3.0)).left, late.right)
    calibration = calibrate_stereo([stereo_shot(), mixed], SENSORS, SolveParameters(check_orientation=False))
    shots = calibration.without_blunders()
    doubts = fit_doubts(calibration.rig, shots, calibration.adjustment, PARAMETERS)
    assert any("each camera alone" in reason for reason in doubts.refused)


def test_without_redundancy_nothing_is_doubted() -> None:
    few = stereo_shot(ids=("3", "6", "10", "11", "15", "18"))
    free = ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1", "K2", "P1")
    calibration = calibrate_stereo([few], SENSORS, SolveParameters(free=free))
    doubts = fit_doubts(calibration.rig, calibration.shots, calibration.adjustment, PARAMETERS)
    assert (doubts.refused, doubts.flagged) == ((), ())
