"""Designs tried before they are built: control fields, and angles and distances of given sizes."""

import numpy as np
import pytest

from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.quality.accuracy import simulated_angles
from spinewatch.calibration.solve.resection import SolveParameters
from spinewatch.planning.control_field import try_design, visible_in_both
from spinewatch.simulation.rigs import table_3_3_rig


def test_the_thesis_grid_of_pegs_is_wholly_in_both_images() -> None:
    typical = {str(i) for i in (3, 4, 5, 6, 9, 10, 11, 12, 15, 16, 17, 18)}
    assert typical <= set(visible_in_both(table_3_3_rig(), pegboard_1995()))


def test_a_design_tried_without_noise_is_exact_and_noise_costs_more_in_depth() -> None:
    rig, field = table_3_3_rig(), pegboard_1995()
    parameters = SolveParameters()
    exact = try_design(field, rig, 0.0, np.random.default_rng(0), trials=1, parameters=parameters)
    assert exact.converged == 1
    assert exact.fresh_sd_mm.max() < 1e-4
    noisy = try_design(field, rig, 0.2, np.random.default_rng(0), trials=4, parameters=parameters)
    assert noisy.converged == 1
    assert noisy.fresh_sd_mm.min() > 0.01
    assert noisy.fresh_sd_mm[2] > noisy.fresh_sd_mm[:2].max()


def test_angles_of_long_legs_are_measured_better_and_exactly_without_noise() -> None:
    rig, centre = table_3_3_rig(), np.array([440.0, 400.0, 60.0])
    exact = simulated_angles(rig, [rig], centre, [30.0], 0.0, np.random.default_rng(1))
    assert exact[0].distance_sd_mm == pytest.approx(0, abs=1e-6)
    short, long = simulated_angles(rig, [rig], centre, [20.0, 80.0], 0.1, np.random.default_rng(1))
    assert short.angle_sd_deg > 3 * long.angle_sd_deg > 0
