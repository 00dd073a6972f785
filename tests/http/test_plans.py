"""Plans over HTTP: the numbers are those of the library, for a stored rig and for one that is to be built."""

from typing import Any

import pytest

from contract.plan import AccuracyPlan, DisparityPlan
from spinewatch.markers import FLAT_10_14_18
from spinewatch.planning.accuracy import straight_chain
from spinewatch.planning.disparity import disparity_grid
from spinewatch.planning.marker_design import design_marker
from spinewatch.planning.plan import PlanParameters, make_plan, planned_heights
from spinewatch.planning.planned_rig import planned_rig
from spinewatch.rig_files.rig_json import rig_from_dict
from spinewatch.simulation.rigs import convergence_point
from tests.http.harness import RIG, Service, problem_of

HEIGHTS = planned_heights((-60.0, 60.0), 7)


def plan(service: Service, path: str = "accuracy", **query: Any) -> dict[str, Any]:
    answer = service.client.get(f"/v1/plans/{path}", params=query)
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


def test_a_stored_rig_is_planned_as_by_the_library(idle: Service) -> None:
    rig = rig_from_dict(RIG)
    found = plan(idle, calibration_id=idle.calibration(), levels="L1,T12", spine_axis="y", centre_sd_px=0.05)
    parameters = PlanParameters(("L1", "T12"), spine_axis=1, sigma_px=0.05, heights_mm=HEIGHTS)
    expected = AccuracyPlan.of(make_plan(rig, FLAT_10_14_18, parameters), rig, found["frame"])
    assert found == expected.model_dump(mode="json")
    assert rig.name in found["frame"]


def test_a_rig_at_the_ceiling_is_planned_as_by_the_library(idle: Service) -> None:
    query: dict[str, Any] = {
        "camera_height_mm": 2000,
        "baseline_mm": 1000,
        "focal_length_mm": 21,
        "image_width_px": 1136,
    }
    found = plan(idle, **query, image_height_px=832, pixel_width_mm=0.005, pixel_height_mm=0.004225)
    rig = planned_rig(1000.0, 2000.0, 21.0, (1136, 832), (0.005, 0.004225))
    expected = make_plan(rig, FLAT_10_14_18, PlanParameters(heights_mm=HEIGHTS))
    assert found == AccuracyPlan.of(expected, rig, found["frame"]).model_dump(mode="json")


def test_a_disc_gives_the_marker_of_the_design(idle: Service) -> None:
    found = plan(idle, disc_radius_mm=20)
    rig, p = planned_rig(), PlanParameters()
    chain = straight_chain(p.vertebrae, convergence_point(rig), p.spacing_mm)
    assert found["marker"]["coordinates_mm"] == design_marker(rig, chain, 0.1, 20.0).coordinates_mm.tolist()


def test_disparities_are_those_of_the_library(idle: Service) -> None:
    rig = planned_rig()
    grid = disparity_grid(rig, (-60.0, 60.0), 7)
    middle = float(convergence_point(rig)[2])
    expected = DisparityPlan.of(disparity_grid(rig, (-60.0 + middle, 60.0 + middle), 7), rig.name, middle)
    assert plan(idle, "disparity") == expected.model_dump(mode="json")
    assert len(grid.z_mm) == len(expected.planes)


def test_the_same_plan_is_not_sent_twice(idle: Service) -> None:
    first = idle.client.get("/v1/plans/accuracy")
    again = idle.client.get("/v1/plans/accuracy", headers={"If-None-Match": first.headers["ETag"]})
    assert (first.status_code, again.status_code) == (200, 304)


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ({"levels": "L1,L1"}, "levels"),
        ({"levels": "L1;T9"}, "levels"),
        ({"baseline_mm": "nan"}, "baseline_mm"),
        ({"baseline_mm": "49"}, "baseline_mm"),
        ({"planes": "26"}, "planes"),
        ({"xx_mm": "10"}, "xx_mm"),
        ({"disc_radius_mm": "6"}, "disc_radius_mm"),
        ({"depth_from_mm": "60"}, "depth_from_mm"),
        ({"spine_axis": "z"}, "spine_axis"),
        ({"calibration_id": "one", "focal_length_mm": "8"}, "focal_length_mm"),
    ],
)
def test_bad_input_names_its_field_and_gives_no_number(
    idle: Service, query: dict[str, str], field: str
) -> None:
    problem = problem_of(idle.client.get("/v1/plans/accuracy", params=query), 422)
    assert problem["errors"][0]["loc"] == ["query", field]


def test_an_implausible_rig_and_a_depth_at_the_cameras_are_refused(idle: Service) -> None:
    problem_of(idle.client.get("/v1/plans/accuracy", params={"focal_length_mm": 1}), 422)
    problem_of(idle.client.get("/v1/plans/accuracy", params={"depth_to_mm": 700}), 422)
    problem_of(
        idle.client.get("/v1/plans/disparity", params={"depth_from_mm": 1500, "depth_to_mm": 1800}), 422
    )


def test_an_unknown_calibration_is_not_found(idle: Service) -> None:
    problem_of(idle.client.get("/v1/plans/accuracy", params={"calibration_id": "none"}), 404)
