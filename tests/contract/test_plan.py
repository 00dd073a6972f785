import json

import numpy as np

from contract.plan import AccuracyPlan, DisparityPlan
from spinewatch.markers import FLAT_10_14_18
from spinewatch.planning.disparity import disparity_grid
from spinewatch.planning.plan import PlanParameters, make_plan
from spinewatch.simulation.rigs import convergence_point, large_rig

RIG = large_rig()


def test_a_plan_passes_through_json_to_the_last_bit() -> None:
    plan = make_plan(RIG, FLAT_10_14_18)
    document = json.loads(AccuracyPlan.of(plan, RIG, "frame").model_dump_json())
    assert document["cobb_sd_deg"] == plan.accuracy.cobb_sd_deg
    assert document["rig"]["baseline_mm"] == RIG.baseline_mm
    assert document["marker"]["distances_mm"] == FLAT_10_14_18.distances_mm.tolist()
    for shown, triad in zip(document["triads"], plan.accuracy.triads, strict=True):
        assert shown["position_sd_mm"] == triad.position_sd_mm.tolist()
    for shown, depth in zip(document["depths"], plan.depths, strict=True):
        assert shown["largest_sd_mm"] == depth.largest_sd_mm
        assert shown["largest_direction"] == depth.largest_direction.tolist()


def test_what_is_not_determined_is_null() -> None:
    plan = make_plan(RIG, FLAT_10_14_18, PlanParameters(vertebrae=("L1",)))
    document = AccuracyPlan.of(plan, RIG, "frame")
    assert document.triads[0].motion_sd_mm == [None, None, None]
    assert document.marker.neighbour_mm is None


def test_disparities_are_those_of_the_grid_with_heights_from_the_middle() -> None:
    middle = float(convergence_point(RIG)[2])
    grid = disparity_grid(RIG, (middle - 60, middle + 60), 5)
    document = DisparityPlan.of(grid, RIG.name, middle)
    assert np.allclose([plane.height_mm for plane in document.planes], [-60, -30, 0, 30, 60])
    mean, sd = grid.distribution()
    assert [plane.mean_px for plane in document.planes] == mean.tolist()
    assert [plane.sd_px for plane in document.planes] == sd.tolist()
    assert all(0 < plane.shown <= 1 for plane in document.planes)
    assert (tuple(document.u_px), tuple(document.v_px)) == grid.bounds_px()
