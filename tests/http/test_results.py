"""Results of a measured surgery."""

import hashlib
import math
from datetime import datetime

import numpy as np
import pytest

from spinewatch.detection.candidates.templates import default_template_set
from tests.http.harness import SAMPLE, VERTEBRAE, Service, code_of, pair


def test_a_stage_has_counts_flags_and_images(service: Service, measured: str, calibration: str) -> None:
    stage = service.client.get(f"/v1/surgeries/{measured}/stages/PRE").json()
    assert (stage["name"], stage["take"], stage["state"]) == ("PRE", 1, "succeeded")
    assert stage["calibration_id"] == calibration
    assert stage["triads"] == 4
    assert stage["features"]["left"] >= 12
    assert stage["features"]["right"] >= 12
    assert isinstance(stage["flags"], list)
    assert stage["job"]["progress"] == 1.0
    assert stage["job"]["attempts"] == 1
    assert stage["job"]["error"] is None
    for side, content in zip(("left", "right"), pair("PRE"), strict=True):
        assert stage["images"][side] == {
            "sha256": hashlib.sha256(content).hexdigest(),
            "media_type": "image/png",
            "width_px": 568,
            "height_px": 416,
            "size_bytes": len(content),
        }


def test_times_are_rfc_3339_in_utc(service: Service, measured: str) -> None:
    job = service.client.get(f"/v1/surgeries/{measured}/stages/PRE").json()["job"]
    times = [job[key] for key in ("created_at", "started_at", "finished_at")]
    assert all(time.endswith("Z") for time in times)
    assert [datetime.fromisoformat(time) for time in times] == sorted(map(datetime.fromisoformat, times))


def test_triads_come_labelled_in_order_with_their_uncertainty(service: Service, measured: str) -> None:
    answer = service.client.get(f"/v1/surgeries/{measured}/stages/PRE/triads").json()
    assert answer["frame"].startswith("object space of calibration ")
    assert [triad["label"] for triad in answer["triads"]] == VERTEBRAE
    for triad in answer["triads"]:
        R = np.array(triad["rotation"])
        assert pytest.approx(np.eye(3), abs=1e-9) == R @ R.T
        assert np.linalg.det(R) == pytest.approx(1)
        assert R[:, 2] == pytest.approx(triad["normal"])
        assert triad["normal"][2] > 0
        assert np.degrees(np.arccos(triad["normal"])) == pytest.approx(triad["angles_deg"])
        assert np.sqrt(np.diag(triad["covariance"])[:3]) == pytest.approx(triad["position_sd_mm"])
        assert set(triad["balls"]) == {"XX", "YY", "MX"}
        assert triad["label_reason"] is None
    assert answer["parameters"]["ball_diameter_mm"] == 8.0
    assert answer["templates"] == default_template_set().version


def test_features_are_in_the_field_best_first(service: Service, measured: str) -> None:
    answer = service.client.get(f"/v1/surgeries/{measured}/stages/PRE/features").json()
    stage = service.client.get(f"/v1/surgeries/{measured}/stages/PRE").json()
    for side in ("left", "right"):
        found = answer["features"][side]
        assert len(found) == stage["features"][side]
        assert all(0 <= f["score"] <= 1 and min(f["sd_px"]) > 0 for f in found)
        assert [f["score"] for f in found] == sorted((f["score"] for f in found), reverse=True)
        u0, v0, u1, v1 = answer["fields"][side]
        assert 0 <= u0 < u1 <= 568
        assert 0 <= v0 < v1 <= 416


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_original_file_comes_back(service: Service, measured: str, side: str) -> None:
    url = f"/v1/surgeries/{measured}/stages/PRE/images/{side}"
    answer = service.client.get(url)
    assert answer.content == (SAMPLE / "PRE" / f"{side}.png").read_bytes()
    assert answer.headers["content-type"] == "image/png"
    assert answer.headers["etag"] == f'"{hashlib.sha256(answer.content).hexdigest()}"'
    again = service.client.get(url, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_motion_is_in_the_frame_of_the_reference_triad(service: Service, measured: str) -> None:
    answer = service.client.get(
        f"/v1/surgeries/{measured}/motion", params={"from": "PRE", "to": "POST"}
    ).json()
    assert (answer["from"]["name"], answer["to"]["name"]) == ("PRE", "POST")
    assert answer["reference_vertebra"] == "L1"
    assert answer["frame"] == "reference triad L1"
    assert answer["missing"] == []
    assert [motion["vertebra"] for motion in answer["vertebrae"]] == VERTEBRAE[1:]
    for motion in answer["vertebrae"]:
        assert math.hypot(*motion["rotation_vector_deg"]) == pytest.approx(motion["angle_deg"])
        assert min(motion["translation_sd_mm"] + motion["rotation_sd_deg"]) > 0
        assert min(motion["angle_sd_deg"], motion["normal_angle_sd_deg"]) > 0


def test_a_repeated_stage_is_flagged_in_the_stage_and_in_its_motion(
    service: Service, surgery: str, calibration: str
) -> None:
    jobs = [service.submit(surgery, name, pair("PRE"), calibration) for name in ("PRE", "POST")]
    assert [service.finished(job)["state"] for job in jobs] == ["succeeded"] * 2
    answer = service.client.get(f"/v1/surgeries/{surgery}/motion", params={"from": "PRE", "to": "POST"})
    flags = [(flag["stage"], flag["code"]) for flag in answer.json()["flags"]]
    assert ("POST", "frame-repeated") in flags
    assert ("PRE", "frame-repeated") not in flags


def test_motion_back_is_the_inverse_rotation(service: Service, measured: str) -> None:
    def rotations(start: str, end: str) -> dict[str, np.ndarray]:
        answer = service.client.get(f"/v1/surgeries/{measured}/motion", params={"from": start, "to": end})
        return {motion["vertebra"]: np.array(motion["rotation"]) for motion in answer.json()["vertebrae"]}

    there, back = rotations("PRE", "POST"), rotations("POST", "PRE")
    for vertebra, R in there.items():
        assert R @ back[vertebra] == pytest.approx(np.eye(3), abs=1e-9)


def test_motion_says_which_vertebrae_are_missing(service: Service, calibration: str) -> None:
    body = {"reference": "case 0", "vertebrae": ["L1", "T11"], "reference_vertebra": "L1"}
    surgery = service.client.post("/v1/surgeries", json=body).json()["id"]
    for name in ("PRE", "POST"):
        service.finished(service.submit(surgery, name, pair(name), calibration))
    labels = {
        name: [
            triad["label"]
            for triad in service.client.get(f"/v1/surgeries/{surgery}/stages/{name}/triads").json()["triads"]
        ]
        for name in ("PRE", "POST")
    }
    answer = service.client.get(f"/v1/surgeries/{surgery}/motion", params={"from": "PRE", "to": "POST"})
    if any("L1" not in names for names in labels.values()):
        assert code_of(answer, 422) == "reference-missing"
        return
    listed = {entry["vertebra"] for entry in answer.json()["vertebrae"]}
    assert listed | {entry["vertebra"] for entry in answer.json()["missing"]} == {"T11"}


def test_motion_needs_two_different_measured_stages(service: Service, measured: str) -> None:
    def motion(**query: str) -> tuple[int, str]:
        answer = service.client.get(f"/v1/surgeries/{measured}/motion", params=query)
        return answer.status_code, answer.json()["type"].rpartition(":")[2]

    assert motion(**{"from": "PRE", "to": "PRE"}) == (422, "same-stage-twice")
    assert motion(**{"from": "PRE", "to": "NONE"}) == (404, "stage-not-found")
    assert motion(**{"from": "PRE"}) == (422, "invalid-request")


def test_results_repeat_bit_by_bit(service: Service, measured: str, calibration: str, surgery: str) -> None:
    service.finished(service.submit(surgery, "PRE", pair("PRE"), calibration))

    def triads(of: str) -> object:
        return service.client.get(f"/v1/surgeries/{of}/stages/PRE/triads").json()["triads"]

    assert triads(surgery) == triads(measured)
