"""Labels that an earlier stage decided on are found again when that stage is revised; spines follow."""

from __future__ import annotations

from typing import Any

from contract.spine import StageSpine
from tests.http.harness import Service, code_of, pair, wait_for
from tests.http.test_revisions import Case
from tests.http.test_spine import SETUP, put
from tests.stage_images import T7_IN_INTER, sample, without


def stage(case: Case, name: str) -> Case:
    other = Case.__new__(Case)
    other.service, other.surgery = case.service, case.surgery
    other.path = f"/v1/surgeries/{case.surgery}/stages/{name}"
    return other


def shows_take(case: Case, take: int) -> dict[str, Any]:
    def found() -> dict[str, Any] | None:
        document = case.get("triads")
        return document if document["take"] == take else None

    document: dict[str, Any] = wait_for(found, f"take {take} of {case.path}")
    return document


def with_a_missing_triad(service: Service, calibration: str) -> tuple[Case, Case]:
    """Stage PRE, and INTER without T7, whose labels PRE decides on."""
    case = Case(service, calibration, [pair("PRE")])
    images = without(sample("INTER"), T7_IN_INTER)
    job = service.submit(case.surgery, "INTER", images, calibration)
    assert service.finished(job)["state"] == "succeeded"
    inter = stage(case, "INTER")
    document = inter.get("triads")
    assert [triad["label"] for triad in document["triads"]] == ["L1", "T11", "T9"]
    assert document["labelled_by"] == {"stage": "PRE", "take": 1, "pair": None}
    return case, inter


def test_a_revised_stage_decides_on_the_labels_of_the_later_ones_again(
    service: Service, calibration: str
) -> None:
    case, inter = with_a_missing_triad(service, calibration)
    x, y = case.get("triads")["triads"][0]["balls"]["XX"]["left"]
    place = case.feature("left", (x, y))
    case.revised(centres=[{"action": "move", "side": "left", "feature": place, "x": x + 0.1, "y": y}])
    after = shows_take(inter, 2)
    assert after["labelled_by"] == {"stage": "PRE", "take": 2, "pair": None}
    assert [triad["label"] for triad in after["triads"]] == ["L1", "T11", "T9"]
    assert after["revision"]["changes"] == {"kind": "relabel", "take": 1}
    assert inter.get("triads", take=1)["labelled_by"]["take"] == 1


def test_labels_that_a_person_gave_stay_and_are_flagged(service: Service, calibration: str) -> None:
    case, inter = with_a_missing_triad(service, calibration)
    inter.revised(labels=[{"triad": 2, "label": "T7"}])
    case.revised(labels=[{"triad": 0, "label": "L1"}])
    after = shows_take(inter, 3)
    assert after["labelled_by"]["take"] == 2
    assert after["triads"][2]["label"] == "T7"
    assert after["triads"][2]["label_manual"]
    assert "labels-kept" in [flag["code"] for flag in after["flags"]]


def spine(service: Service, surgery: str, name: str, take: int) -> StageSpine:
    def found() -> StageSpine | None:
        answer = service.client.get(f"/v1/surgeries/{surgery}/stages/{name}/spine")
        if answer.status_code != 200:
            return None
        document = StageSpine.model_validate_json(answer.content)
        return document if document.take == take else None

    document: StageSpine = wait_for(found, f"the spine of take {take} of {name}")
    return document


def test_spines_follow_a_retake_and_a_revision(service: Service, calibration: str) -> None:
    case = Case(service, calibration, [pair("PRE")])
    put(service, case.surgery)
    job = service.submit(case.surgery, "POST", pair("POST"), calibration)
    assert service.finished(job)["state"] == "succeeded"
    first = spine(service, case.surgery, "POST", 1)
    files = {side: (side, image) for side, image in zip(("left", "right"), pair("INTER"), strict=True)}
    data = {"name": "POST", "calibration_id": calibration, "retake": "true"}
    again = service.client.post(f"/v1/surgeries/{case.surgery}/stages", data=data, files=files)
    assert case.ended(again) == "succeeded"
    second = spine(service, case.surgery, "POST", 2)
    assert second.measures != first.measures
    post = stage(case, "POST")
    post.revised(removed=[3])
    third = spine(service, case.surgery, "POST", 3)
    assert third.measures != second.measures
    case.revised(labels=[{"triad": 0, "label": "L1"}])
    assert spine(service, case.surgery, "PRE", 2).take == 2


def test_spines_are_computed_again_on_request(service: Service, calibration: str) -> None:
    surgery = service.surgery()
    path = f"/v1/surgeries/{surgery}/spine/computations"
    assert code_of(service.client.post(path), 409) == "spine-setup-missing"
    put(service, surgery, SETUP)
    answer = service.client.post(path)
    assert (answer.status_code, answer.json()["kind"]) == (202, "spine")
    job = service.finished(answer.headers["location"].removeprefix("/v1/jobs/"))
    assert job["state"] == "succeeded"
    assert code_of(service.client.post("/v1/surgeries/none/spine/computations"), 404) == "surgery-not-found"
