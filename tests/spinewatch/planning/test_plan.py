import numpy as np
import pytest

from spinewatch.errors import ParameterError
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.planning.accuracy import expected_accuracy, straight_chain
from spinewatch.planning.plan import PlanParameters, make_plan, planned_heights
from spinewatch.planning.planned_rig import planned_rig
from spinewatch.simulation.rigs import convergence_point, large_rig


def test_a_plan_has_the_accuracy_of_a_chain_in_the_middle_of_the_view() -> None:
    rig, p = large_rig(), PlanParameters(sigma_px=0.05, spine_axis=1)
    chain = straight_chain(p.vertebrae, convergence_point(rig), p.spacing_mm, 1)
    expected = expected_accuracy(rig, FLAT_10_14_18, p.vertebrae, chain, 0.05, p.common_sd_mrad)
    plan = make_plan(rig, FLAT_10_14_18, p)
    assert plan.accuracy.cobb_sd_deg == expected.cobb_sd_deg
    assert [depth.height_mm for depth in plan.depths] == list(p.heights_mm)
    assert plan.ambiguity is not None


def test_at_the_ceiling_with_the_same_field_of_view_and_baseline_depth_is_less_accurate() -> None:
    cart = make_plan(planned_rig(), FLAT_10_14_18)
    ceiling = make_plan(planned_rig(height_mm=2000.0, focal_length_mm=7.7 * 2000 / 736), FLAT_10_14_18)
    assert ceiling.pixel_mm == pytest.approx(cart.pixel_mm, rel=0.05)
    assert ceiling.accuracy.triads[0].position_sd_mm[2] > 2 * cart.accuracy.triads[0].position_sd_mm[2]


def test_a_marker_of_four_balls_has_no_ambiguity() -> None:
    balls = np.array([[20.0, 0, 0], [0, -15, 0], [-12, 0, 0], [0, 4, 16]])
    assert make_plan(planned_rig(), TriadModel("four", ("A", "B", "C", "D"), balls, 8.0)).ambiguity is None


def test_heights_next_to_the_cameras_are_refused() -> None:
    with pytest.raises(ParameterError, match="half of the way"):
        make_plan(planned_rig(), FLAT_10_14_18, PlanParameters(heights_mm=(0.0, 400.0)))


def test_heights_run_from_the_lowest_to_the_highest() -> None:
    assert planned_heights((-10.0, 20.0), 4) == (-10.0, 0.0, 10.0, 20.0)
    with pytest.raises(ParameterError, match="exchange"):
        planned_heights((5.0, 5.0), 3)
