import numpy as np

from spinewatch.calibration.quality.rig_samples import sample_rigs
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, camera_vector
from spinewatch.calibration.stereo import calibrate_stereo
from tests.spinewatch.calibration.simulated import SENSORS, moved_board, stereo_shot


def test_samples_have_mean_and_covariance_of_the_adjustment() -> None:
    shots = [stereo_shot(sigma_px=0.05), stereo_shot("A", placement=moved_board(1), sigma_px=0.05, seed=1)]
    calibration = calibrate_stereo(shots, SENSORS)
    rigs = sample_rigs(calibration.adjustment, 2000, np.random.default_rng(0), "cart")
    assert {rig.name for rig in rigs} == {"cart"}
    vectors = np.array([camera_vector(rig.left) for rig in rigs])
    free = [PARAMETER_NAMES.index(n) for n in calibration.free["left"]]
    n = len(free)
    deviation = (vectors - camera_vector(calibration.rig.left))[:, free]
    sd = np.array(list(calibration.sd["left"].values()))
    assert np.all(np.abs(deviation.mean(axis=0)) < 4 * sd / np.sqrt(2000))
    assert np.allclose(
        np.cov(deviation.T) / np.outer(sd, sd), calibration.adjustment.correlation[:n, :n], atol=0.1
    )


def test_parameters_that_were_held_do_not_vary() -> None:
    calibration = calibrate_stereo([stereo_shot(sigma_px=0.05)], SENSORS)
    held = [i for i, n in enumerate(PARAMETER_NAMES) if n not in calibration.free["right"]]
    true = camera_vector(calibration.rig.right)
    rigs = sample_rigs(calibration.adjustment, 3, np.random.default_rng(1))
    assert len(rigs) == 3
    assert held
    for rig in rigs:
        assert np.array_equal(camera_vector(rig.right)[held], true[held])
        assert not np.array_equal(camera_vector(rig.right), true)
