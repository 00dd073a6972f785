import numpy as np
import pytest

from spinewatch.errors import ParameterError
from spinewatch.markers import FLAT_10_14_18
from spinewatch.planning.accuracy import expected_accuracy, straight_chain
from spinewatch.planning.marker_design import MarkerDesignParameters, design_marker
from spinewatch.simulation.rigs import convergence_point, large_rig

LEVELS = ("L1", "T9")


def test_the_marker_fits_the_disc_and_is_measured_better_than_the_thesis_marker() -> None:
    rig = large_rig()
    chain = straight_chain(LEVELS, convergence_point(rig), 80.0)
    marker = design_marker(rig, chain, 0.1, 18.0)
    assert np.linalg.norm(marker.coordinates_mm, axis=1) == pytest.approx([18, 18, 18])
    assert np.diff(np.sort(marker.distances_mm)).min() >= 4
    thesis, new = (
        expected_accuracy(rig, model, LEVELS, chain, 0.1).triads[0] for model in (FLAT_10_14_18, marker)
    )
    assert new.out_of_plane_sd_deg < 0.8 * thesis.out_of_plane_sd_deg


def test_constraints_are_kept() -> None:
    rig = large_rig()
    chain = straight_chain(("L1",), convergence_point(rig), 50.0)
    p = MarkerDesignParameters(ball_diameter_mm=6.0, min_difference_mm=6.0, coarse_step_deg=30.0)
    marker = design_marker(rig, chain, 0.1, 15.0, p)
    assert marker.ball_diameter_mm == 6
    assert np.diff(np.sort(marker.distances_mm)).min() >= 6
    assert marker.distances_mm.min() >= 9


def test_a_disc_that_is_too_small_is_refused() -> None:
    rig = large_rig()
    chain = straight_chain(LEVELS, convergence_point(rig), 80.0)
    with pytest.raises(ParameterError, match="larger disc"):
        design_marker(rig, chain, 0.1, 6.0)
