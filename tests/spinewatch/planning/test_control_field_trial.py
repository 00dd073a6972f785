import numpy as np

from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.planning.control_field_trial import try_control_field
from spinewatch.simulation.rigs import table_3_3_rig


def test_a_trial_without_noise_is_exact() -> None:
    rng = np.random.default_rng(0)
    trial = try_control_field(pegboard_1995(), table_3_3_rig(), 0.0, rng, trials=1)
    assert trial.converged == 1
    assert trial.verification_sd_mm.max() < 1e-4


def test_depth_is_less_accurate_and_peg_errors_add_to_noise() -> None:
    rig, field = table_3_3_rig(), pegboard_1995()
    noisy = try_control_field(field, rig, 0.2, np.random.default_rng(0), trials=2)
    assert noisy.converged == 1
    assert noisy.verification_sd_mm.min() > 0.01
    assert noisy.verification_sd_mm[2] > noisy.verification_sd_mm[:2].max()
    inexact = try_control_field(field, rig, 0.2, np.random.default_rng(0), trials=2, point_sd_mm=0.3)
    assert inexact.verification_sd_mm.min() > 1.5 * noisy.verification_sd_mm.min()


def test_failed_trials_are_counted() -> None:
    rng = np.random.default_rng(0)
    trial = try_control_field(pegboard_1995(), table_3_3_rig(), 0.1, rng, trials=2, ids=("3", "4", "9"))
    assert trial.converged == 0
    assert len(trial.error_codes) == 2
    assert np.isnan(trial.calibration_sd_mm).all()


def test_the_same_seed_gives_the_same_trial() -> None:
    first, second = (
        try_control_field(pegboard_1995(), table_3_3_rig(), 0.1, np.random.default_rng(3), trials=1)
        for _ in range(2)
    )
    assert np.array_equal(first.verification_sd_mm, second.verification_sd_mm)
