import numpy as np
import pytest

from spinewatch.calibration.quality.accuracy import calibration_accuracy, reconstruct
from spinewatch.calibration.quality.leave_one_out import leave_one_out
from spinewatch.calibration.solve.bundle import adjust
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import StereoCalibration, calibrate_stereo
from spinewatch.camera import Rig
from tests.spinewatch.calibration.simulated import SENSORS, TYPICAL, moved_board, stereo_shot

FREE = ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1")


def calibration(n_shots: int = 1) -> StereoCalibration:
    shots = [stereo_shot(sigma_px=0.1)]
    if n_shots > 1:
        shots.append(stereo_shot("A", placement=moved_board(1), sigma_px=0.1, seed=1))
    return calibrate_stereo(shots, SENSORS, SolveParameters(free=FREE))


def test_points_left_out_are_reconstructed_less_accurately_than_points_used() -> None:
    found = calibration()
    accuracy = leave_one_out(found.adjustment, found.shots)
    assert accuracy is not None
    assert accuracy.ids == TYPICAL
    assert not accuracy.used
    assert np.all(accuracy.sd_mm > calibration_accuracy(found.rig, found.shots)[0].sd_mm)


@pytest.mark.parametrize("n_shots", [1, 2])
def test_one_gauss_newton_step_is_nearly_the_adjustment_without_the_point(n_shots: int) -> None:
    found = calibration(n_shots)
    accuracy = leave_one_out(found.adjustment, found.shots)
    assert accuracy is not None
    block = found.adjustment.block
    for id_ in TYPICAL[::5]:
        without = {
            view: points.keep(np.array([i != id_ for i in points.ids]))
            for view, points in block.images.items()
        }
        again = adjust(type(block)(block.cameras, block.placements, without, block.free)).block
        rig = Rig("without", *again.cameras)
        for s, shot in enumerate(found.shots):
            k = shot.left.ids.index(id_)
            point = reconstruct(rig, shot.left.pixels[[k]], shot.right.pixels[[k]])
            full = again.placements[s].inverse()(point)[0] - shot.left.control_mm[k]
            one_step = accuracy.residuals_mm[s * len(TYPICAL) + k]
            assert np.abs(one_step - full).max() < 0.02 + 0.05 * np.abs(full).max()


def test_without_redundancy_nothing_is_left_out() -> None:
    minimal = calibrate_stereo(
        [stereo_shot(ids=("3", "6", "10", "11", "15", "18"))], SENSORS, SolveParameters(free=FREE)
    )
    assert leave_one_out(minimal.adjustment, minimal.shots) is None
