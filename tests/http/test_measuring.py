"""What is sent of the measurement with the images of a stage reaches the worker, its result and its revisions."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import httpx
import numpy as np
import pytest

from spinewatch.rig_files.rig_json import rig_from_dict
from tests.http.harness import RIG, Service, code_of, pair


def submit(service: Service, surgery: str, calibration: str, **parts: Any) -> httpx.Response:
    left, right = pair("PRE")
    data = {"name": "PRE", "calibration_id": calibration, **parts}
    files = {"left": ("left.png", left), "right": ("right.png", right)}
    return service.client.post(f"/v1/surgeries/{surgery}/stages", data=data, files=files)


def ended(service: Service, answer: httpx.Response) -> str:
    assert answer.status_code == 202, answer.text
    return str(service.finished(answer.headers["location"].removeprefix("/v1/jobs/"))["state"])


def triads(service: Service, surgery: str) -> dict[str, Any]:
    answer = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/triads")
    document: dict[str, Any] = answer.json()
    return document


def test_range_markers_and_refinement_are_chosen_with_the_images(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    answer = submit(
        service,
        surgery,
        calibration,
        range_mm="500,900",
        marker=["flat:18,14,10", "flat:30,25,12"],
        refine="true",
    )
    assert ended(service, answer) == "succeeded"
    assert answer.json()["measuring"] == {
        "range_mm": "500,900",
        "markers": ["flat:18,14,10", "flat:30,25,12"],
        "refine": True,
        "templates": None,
    }
    parameters = triads(service, surgery)["parameters"]
    matching = parameters["search"]["matching"]
    assert matching["epipolar"]["range_mm"] == [500, 900]
    assert matching["refinement"]["enabled"] is True
    assert parameters["markers"] == ["flat-10-14-18", "flat-12-25-30"]


@pytest.mark.parametrize(
    ("markers", "problem"),
    [
        (["flat:18,14,10", "flat:9,4,6"], "would overlap"),
        (["orthogonal:30,22,16", "orthogonal:22,16,30"], "cannot be told apart"),
    ],
)
def test_markers_that_cannot_be_are_refused_with_their_place(
    service: Service, calibration: str, markers: list[str], problem: str
) -> None:
    answer = submit(service, service.surgery(), calibration, marker=markers)
    assert code_of(answer, 422) == "invalid-parameter"
    assert answer.json()["errors"][0]["loc"] == ["body", "marker", 1]
    assert problem in answer.json()["detail"]


def test_a_marker_with_its_legs_in_another_order_is_flagged(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    assert ended(service, submit(service, surgery, calibration, marker=["flat:10,14,18"])) == "succeeded"
    (detail,) = [f["detail"] for f in triads(service, surgery)["flags"] if f["code"] == "marker-doubtful"]
    assert "4 triads in full view fit the marker flat:18,14,10" in detail


def test_a_new_measurement_keeps_what_was_sent(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    assert ended(service, submit(service, surgery, calibration, range_mm="500,900")) == "succeeded"
    changes = {"kind": "measure", "take": 1, "parameters": {"detection": {"min_score": 0.15}}}
    answer = service.client.post(f"/v1/surgeries/{surgery}/stages/PRE/revisions", json=changes)
    assert ended(service, answer) == "succeeded"
    assert answer.json()["measuring"] is None
    measured = triads(service, surgery)
    parameters = measured["parameters"]
    assert parameters["search"]["matching"]["epipolar"]["range_mm"] == [500, 900]
    assert parameters["detection"]["min_score"] == 0.15
    (detail,) = [flag["detail"] for flag in measured["flags"] if flag["code"] == "parameters-changed"]
    assert "detection.min_score (0.15 instead of 0.2)" in detail
    assert "range_mm" not in detail


def test_without_a_word_the_workers_choose(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    answer = submit(service, surgery, calibration)
    assert ended(service, answer) == "succeeded"
    assert answer.json()["measuring"] is None
    parameters = triads(service, surgery)["parameters"]
    assert parameters["search"]["matching"]["epipolar"]["range_mm"] is None
    assert parameters["markers"] == ["flat-10-14-18"]


def test_the_same_pair_measured_otherwise_is_not_the_same(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    assert ended(service, submit(service, surgery, calibration, range_mm="500,900")) == "succeeded"
    assert submit(service, surgery, calibration, range_mm="500,900").status_code == 200
    other = submit(service, surgery, calibration, range_mm="550,900")
    assert code_of(other, 409) == "stage-exists"


def test_templates_that_no_worker_has_end_the_job(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    assert ended(service, submit(service, surgery, calibration, templates="1066")) == "failed"


def test_a_rig_with_parallel_axes_measures_with_a_range(service: Service) -> None:
    rig = deepcopy(RIG)
    rig["right"]["rotation_deg"] = rig["left"]["rotation_deg"]
    calibration = service.calibration(rig)
    without = submit(service, service.surgery(), calibration)
    assert ended(service, without) == "failed"
    error = service.client.get(without.headers["location"]).json()["error"]
    assert error["type"] == "urn:spinewatch:problem:invalid-rig"
    assert "give the range" in error["detail"]
    assert ended(service, submit(service, service.surgery(), calibration, range_mm="500,900")) == "succeeded"


@pytest.mark.parametrize(
    ("parts", "field"),
    [
        ({"range_mm": "900,500"}, "range_mm"),
        ({"range_mm": "500"}, "range_mm"),
        ({"marker": "cube:1,2,3"}, "marker"),
        ({"marker": ["flat-10-14-18"] * 9}, "marker"),
        ({"refine": "perhaps"}, "refine"),
    ],
)
def test_what_cannot_be_used_is_refused(idle: Service, parts: dict[str, Any], field: str) -> None:
    answer = submit(idle, idle.surgery(), idle.calibration(), **parts)
    assert answer.status_code == 422
    assert field in answer.text


def test_points_are_reconstructed_from_their_images(idle: Service) -> None:
    calibration = idle.calibration()
    document = idle.client.get(f"/v1/calibrations/{calibration}").json()

    rig = rig_from_dict(document["rig"])
    true_mm = np.array([[430.0, 390.0, 90.0], [460.0, 400.0, 95.0]])
    sides = {
        side: [f"{u:.6f},{v:.6f}" for u, v in camera.project(true_mm)]
        for side, camera in (("left", rig.left), ("right", rig.right))
    }
    answer = idle.client.get(f"/v1/calibrations/{calibration}/points", params={**sides, "centre_sd_px": 0.2})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    np.testing.assert_allclose([point["position_mm"] for point in found["points"]], true_mm, atol=1e-3)
    assert all(0.05 < max(point["position_sd_mm"]) < 2 for point in found["points"])
    assert max(point["parallax_mm"] for point in found["points"]) < 1e-3
    assert rig.name in found["frame"]


@pytest.mark.parametrize(
    ("query", "status"),
    [
        ({"left": ["1,2"], "right": ["1,2", "3,4"]}, 422),
        ({"left": ["1;2"], "right": ["1,2"]}, 422),
        ({"left": ["1,2"]}, 422),
        ({"left": ["1,2"] * 25, "right": ["1,2"] * 24}, 422),
        ({"left": ["1,2"], "right": ["1,2"], "centre_sd_px": "nan"}, 422),
        ({"left": ["100,2"], "right": ["568,2"]}, 422),
        ({"left": ["-840975.5,765959"], "right": ["100,100"]}, 422),
        ({"left": ["0,200"], "right": ["567,200"]}, 422),
    ],
)
def test_image_points_that_cannot_be_used(idle: Service, query: dict[str, Any], status: int) -> None:
    assert (
        idle.client.get(f"/v1/calibrations/{idle.calibration()}/points", params=query).status_code == status
    )


def test_parallel_rays_have_no_point(idle: Service) -> None:
    rig = deepcopy(RIG)
    rig["right"] = {**rig["left"], "position_mm": rig["right"]["position_mm"]}
    points = f"/v1/calibrations/{idle.calibration(rig)}/points"
    answer = idle.client.get(points, params={"left": "100,100", "right": "100,100"})
    assert answer.status_code == 422
    assert "do not meet" in answer.text


def test_points_of_an_unknown_calibration(idle: Service) -> None:
    answer = idle.client.get("/v1/calibrations/none/points", params={"left": "1,2", "right": "1,2"})
    assert answer.status_code == 404


def test_a_control_field_is_designed_for_a_rig(idle: Service) -> None:
    query: dict[str, Any] = {"rows": 5, "columns": 6, "spacing_mm": 60, "calibration_id": idle.calibration()}
    plan = idle.client.get("/v1/plans/control-field", params=query).json()
    assert len(plan["points"]) == 30
    assert set(plan["visible"]) <= {point["id"] for point in plan["points"]}
    assert len(plan["visible"]) >= 12
    assert plan["csv"].splitlines()[0] == "id,x_mm,y_mm,z_mm"
    again = idle.client.get("/v1/plans/control-field", params=query).json()
    assert again == plan
    assert idle.client.get("/v1/plans/control-field", params={"rows": 2}).status_code == 422
