"""The spine over HTTP: setup, stages, measures, summary, motion and exports."""

from __future__ import annotations

import json
from typing import Any

import httpx
import numpy as np
import pytest

from contract.measure_definition import MeasureDefinitions
from contract.spine import StageSpine
from contract.spine_setup import StoredSpineSetup
from contract.stage_measures import StageMeasures
from contract.summary import SurgerySummary
from spinewatch.spine.definitions import DEFINITIONS
from tests.http.harness import Service, code_of, pair, problem_of, wait_for

AXES = {"kind": "directions", "cephalad": "+x", "left": "+y"}
SETUP: dict[str, Any] = {"patient_axes": AXES, "initial": {"kind": "generic"}}
TARGET = [{"vertebra": "T9", "angles_deg": [0.0, 20.0, 0.0]}]
HEADER = "vertebra,x_mm,y_mm,z_mm,coronal_deg,sagittal_deg,axial_deg,position_sd_mm,rotation_sd_deg\n"
CSV = (
    HEADER
    + "L1,0,0,0,5,-10,2,1,2\nT11,5,-8,60,2,0,3,1,2\nT9,0,-20,110,-4,15,4,1,2\nT7,-10,-22,155,-9,20,3,1,2\n"
)


def poses(**changes: Any) -> dict[str, Any]:
    levels = ("T7", "T9", "T11", "L1")
    listed = [
        {"vertebra": level, "position_mm": [0.0, 0.0, 150.0 - 50.0 * n], "angles_deg": [0.0, 0.0, 0.0]}
        for n, level in enumerate(levels)
    ]
    return {"kind": "poses", "frame": "patient", "poses": listed, **changes}


def match(service: Service, surgery: str) -> dict[str, str]:
    """Return the header that names the setup as it is; none without one."""
    answer = service.client.get(f"/v1/surgeries/{surgery}/spine")
    return {"If-Match": answer.headers["etag"]} if answer.status_code == 200 else {}


def put(service: Service, surgery: str, setup: dict[str, Any] = SETUP) -> httpx.Response:
    return service.client.put(f"/v1/surgeries/{surgery}/spine", json=setup, headers=match(service, surgery))


def put_csv(service: Service, surgery: str, text: str | bytes, **query: str) -> httpx.Response:
    headers = {"Content-Type": "text/csv", **match(service, surgery)}
    url = f"/v1/surgeries/{surgery}/spine/initial"
    return service.client.put(url, content=text, headers=headers, params=query)


def spine(service: Service, surgery: str, stage: str) -> httpx.Response:
    return service.client.get(f"/v1/surgeries/{surgery}/stages/{stage}/spine")


def computed(service: Service, surgery: str, stage: str, revision: int = 1) -> StageSpine:
    """Return the spine of a stage when it is computed with a revision of the setup."""

    def found() -> StageSpine | None:
        answer = spine(service, surgery, stage)
        if answer.status_code != 200:
            assert code_of(answer, 409) in {"spine-not-ready", "stage-not-measured"}
            return None
        return StageSpine.model_validate_json(answer.text)

    made: StageSpine = wait_for(found, "the spine")
    assert made.setup_revision == revision
    return made


@pytest.fixture(scope="module")
def with_spines(service: Service, calibration: str) -> str:
    """A surgery with a setup and a target, whose stages PRE, INTER and POST have spines."""
    surgery = service.surgery()
    put(service, surgery, {**SETUP, "target": TARGET})
    for name in ("PRE", "INTER", "POST"):
        service.submit(surgery, name, pair(name), calibration)
    for name in ("PRE", "INTER", "POST"):
        computed(service, surgery, name)

    def settled() -> bool:
        after = StageSpine.model_validate_json(spine(service, surgery, "POST").text)
        return after.since_previous is not None and after.since_previous.since.name == "INTER"

    wait_for(settled, "the spine of POST after that of INTER")
    return surgery


def test_a_surgery_without_a_setup_says_what_to_do(service: Service, measured: str) -> None:
    for path in ("spine", "stages/PRE/spine", "stages/PRE/measures"):
        answer = service.client.get(f"/v1/surgeries/{measured}/{path}")
        problem = problem_of(answer, 409)
        assert problem["type"].endswith(":spine-setup-missing")
        assert "PUT" in problem["detail"]
    summary = service.client.get(f"/v1/surgeries/{measured}/summary").json()
    assert summary["setup"] is None
    assert {stage["spine_reason"] for stage in summary["stages"]} == {"the surgery has no setup of the spine"}


def test_a_setup_after_the_stages_computes_their_spines(
    service: Service, calibration: str, surgery: str
) -> None:
    job = service.submit(surgery, "PRE", pair("PRE"), calibration)
    assert service.finished(job)["state"] == "succeeded"
    answer = put(service, surgery)
    assert answer.status_code == 200, answer.text
    ended = service.finished(answer.headers["Location"].removeprefix("/v1/jobs/"))
    assert (ended["kind"], ended["state"], ended["surgery_id"]) == ("spine", "succeeded", surgery)
    found = computed(service, surgery, "PRE")
    assert found.initial == "generic"
    assert all(measure.assumed for measure in found.measures)
    assert found.since_baseline is None
    assert found.since_previous is None


def test_a_change_is_a_new_revision_and_the_same_setup_is_not(service: Service, surgery: str) -> None:
    first = put(service, surgery)
    again = put(service, surgery)
    assert first.json() == again.json()
    assert "Location" not in again.headers
    assert put(service, surgery, {**SETUP, "target": TARGET}).json()["revision"] == 2
    url = f"/v1/surgeries/{surgery}/spine"
    stored = StoredSpineSetup.model_validate_json(service.client.get(url).text)
    assert (stored.revision, stored.setup.target is None) == (2, False)
    revisions = service.client.get(f"{url}/revisions").json()
    assert [item["revision"] for item in revisions["items"]] == [2, 1]
    assert revisions["total"] == 2
    assert all(item["actor"].endswith(" test") for item in revisions["items"])
    assert service.events(surgery).count("http:spine:configured") == 2


def test_the_spine_of_a_stage(service: Service, with_spines: str) -> None:
    pre, inter, post = (computed(service, with_spines, name) for name in ("PRE", "INTER", "POST"))
    assert [vertebra.vertebra for vertebra in pre.vertebrae] == [
        vertebra.vertebra for vertebra in post.vertebrae
    ]
    assert {v.vertebra for v in post.vertebrae if v.marked} == {"L1", "T11", "T9", "T7"}
    origins = {vertebra.vertebra: vertebra.origin.value for vertebra in post.vertebrae}
    assert (origins["T9"], origins["T10"], origins["T5"]) == ("assumed", "assumed", "not_measured")
    for vertebra in post.vertebrae:
        if vertebra.position_mm is None:
            assert vertebra.reason
            continue
        R = np.array(vertebra.rotation)
        assert pytest.approx(np.eye(3), abs=1e-9) == R @ R.T
        assert np.linalg.det(R) == pytest.approx(1)
        assert vertebra.position_sd_mm is not None
        assert vertebra.vertebra == "L1" or min(vertebra.position_sd_mm) > 0
    assert post.since_baseline is not None
    assert post.since_previous is not None
    assert (post.since_baseline.since.name, post.since_previous.since.name) == ("PRE", "INTER")
    assert inter.since_previous == inter.since_baseline
    assert post.remaining is not None
    assert [item.vertebra for item in post.remaining] == ["T9"]
    assert {measure.definition for measure in post.measures} <= set(DEFINITIONS)
    assert service.events(with_spines).count("http:spine:configured") == 1


def test_measures_are_those_of_the_spine(service: Service, with_spines: str) -> None:
    answer = service.client.get(f"/v1/surgeries/{with_spines}/stages/POST/measures")
    measures = StageMeasures.model_validate_json(answer.text)
    assert measures == StageMeasures.of(computed(service, with_spines, "POST"))
    cobb = next(item for item in measures.measures if item.definition == "cobb-fixed")
    assert cobb.value is not None
    assert cobb.interval is not None
    assert cobb.interval[0] < cobb.value < cobb.interval[1]  # type: ignore[operator]


def test_the_summary_has_every_stage_in_one_document(service: Service, with_spines: str) -> None:
    answer = service.client.get(f"/v1/surgeries/{with_spines}/summary")
    summary = SurgerySummary.model_validate_json(answer.text)
    assert [stage.name for stage in summary.stages] == ["PRE", "INTER", "POST"]
    assert summary.setup is not None
    for stage in summary.stages:
        assert stage.spine == computed(service, with_spines, stage.name)
        triads = service.client.get(f"/v1/surgeries/{with_spines}/stages/{stage.name}/triads").json()
        assert stage.triads is not None
        assert [triad.label for triad in stage.triads] == [triad["label"] for triad in triads["triads"]]
        assert stage.spine_reason is None


def test_documents_have_an_etag(service: Service, with_spines: str) -> None:
    surgery = f"/v1/surgeries/{with_spines}"
    for path in (
        f"{surgery}/spine", f"{surgery}/summary", f"{surgery}/stages/POST/spine",
        f"{surgery}/stages/POST/measures", f"{surgery}/motion?from=PRE&to=POST", "/v1/measure-definitions",
    ):  # fmt: skip
        answer = service.client.get(path, headers={"Accept-Encoding": "identity"})
        tag = answer.headers["ETag"]
        assert tag.startswith('"')
        for value in (tag, f'"other", W/{tag}', "*"):
            again = service.client.get(path, headers={"If-None-Match": value})
            assert (again.status_code, again.content, again.headers["ETag"]) == (304, b"", tag)
        other = service.client.get(path, headers={"If-None-Match": '"other"'})
        assert (other.status_code, other.content) == (200, answer.content)


def test_motion_of_the_bodies_is_that_of_the_spine(service: Service, with_spines: str, measured: str) -> None:
    def motion(surgery: str, start: str, end: str) -> dict[str, Any]:
        answer = service.client.get(f"/v1/surgeries/{surgery}/motion", params={"from": start, "to": end})
        assert answer.status_code == 200, answer.text
        document: dict[str, Any] = answer.json()
        return document

    post = computed(service, with_spines, "POST")
    for change in (post.since_baseline, post.since_previous):
        assert change is not None
        bodies = motion(with_spines, change.since.name, "POST")["bodies"]
        assert (bodies["frame"], bodies["setup_revision"], bodies["assumed"]) == (post.frame, 1, True)
        assert [item["vertebra"] for item in bodies["vertebrae"]] == ["T7", "T9", "T11", "L1"]
        expected = {item.vertebra: item.model_dump(mode="json") for item in change.vertebrae}
        for item in bodies["vertebrae"]:
            for name in (
                "translation_mm",
                "rotation_vector_deg",
                "derotation_deg",
                "distraction_mm",
                "coronal_sd_deg",
            ):
                assert item[name] == pytest.approx(expected[item["vertebra"]][name], abs=1e-9), name
    without = motion(measured, "PRE", "POST")
    assert without["bodies"] is None
    assert "setup" in without["bodies_reason"]
    assert [item["vertebra"] for item in without["vertebrae"]] == ["T11", "T9", "T7"]


def test_the_definitions_are_listed(service: Service) -> None:
    answer = service.client.get("/v1/measure-definitions")
    listed = MeasureDefinitions.model_validate_json(answer.text)
    assert [item.id for item in listed.items] == list(DEFINITIONS)


def test_poses_from_a_csv_file_replace_the_initial_configuration(
    service: Service, calibration: str, surgery: str
) -> None:
    assert code_of(put_csv(service, surgery, CSV), 409) == "spine-setup-missing"
    put(service, surgery)
    answer = put_csv(service, surgery, CSV, frame="patient")
    assert answer.status_code == 200, answer.text
    assert answer.json()["revision"] == 2
    service.submit(surgery, "PRE", pair("PRE"), calibration)
    found = computed(service, surgery, "PRE", revision=2)
    (t9,) = [vertebra for vertebra in found.vertebrae if vertebra.vertebra == "T9"]
    assert (t9.coronal_tilt_deg, t9.sagittal_tilt_deg, t9.axial_rotation_deg) == pytest.approx((-4, 15, 4))
    assert t9.origin == "measured"
    cobb = next(item for item in found.measures if item.definition == "cobb-fixed")
    assert cobb.value == pytest.approx(5 - -9)  # phi of L1 less that of T7, convex to the right


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (b"\xff\xfe", ["csv"]),
        ("", ["csv"]),
        ("vertebra,x_mm\nL1,0\nT9,1\n", ["csv", "row 1"]),
        (CSV.replace("T9,0,", "T9,near,"), ["csv", "row 4", "x_mm"]),
        (CSV.replace("T9,0,", "T9,nan,"), ["csv", "row 4", "x_mm"]),
        (CSV.replace("T9,0,", "T9,"), ["csv", "row 4"]),
        (CSV.replace("T9,", "T11,"), ["initial", "poses", 2]),
        (CSV.replace("T9,", "T99,"), ["initial", "poses", 2]),
        (CSV.replace("3,1,2\nT9", "3,-1,2\nT9"), ["csv", "row 3", "position_sd_mm"]),
    ],
)
def test_a_csv_file_that_cannot_be_used(
    service: Service, surgery: str, text: str | bytes, place: list[str | int]
) -> None:
    put(service, surgery)
    problem = problem_of(put_csv(service, surgery, text), 422)
    assert problem["errors"][0]["loc"] == ["body", *place]
    assert service.client.get(f"/v1/surgeries/{surgery}/spine").json()["revision"] == 1


def changed(path: list[str | int], value: Any) -> dict[str, Any]:
    setup = json.loads(json.dumps({"patient_axes": AXES, "initial": poses()}))
    place: Any = setup
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = value
    return setup  # type: ignore[no-any-return]


SKEW = [[1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]]
MIRROR = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
PA = ("superior_left", "superior_right", "inferior_left", "inferior_right")
LATERAL = ("superior_anterior", "superior_posterior", "inferior_anterior", "inferior_posterior")
RADIOGRAPHS = {
    "kind": "radiographs",
    "pa": "of another surgery",
    "lateral": "none",
    "vertebrae": [
        {
            "vertebra": level,
            "pa": {corner: [0.0, 0.0] for corner in PA},
            "lateral": {corner: [0.0, 0.0] for corner in LATERAL},
        }
        for level in ("T7", "T9", "T11", "L1")
    ],
    "common": [
        {"name": str(number), "pa": [0.0, 0.0], "lateral": [0.0, 0.0], "triad": "L1"} for number in range(3)
    ],
}


@pytest.mark.parametrize(
    ("setup", "code", "place"),
    [
        (changed(["patient_axes", "left"], "-x"), "invalid-patient-axes", ["patient_axes"]),
        (changed(["levels"], ["L1", "T10"]), "not-marked", ["levels", 1]),
        (changed(["levels"], ["L1", "L1"]), "duplicate-level", ["levels", 1]),
        (changed(["reference_vertebra"], "T10"), "not-marked", ["reference_vertebra"]),
        (changed(["baseline"], "NEVER"), "unknown-stage", ["baseline"]),
        (changed(["initial", "poses", 1, "vertebra"], "T7"), "duplicate-level", ["initial", "poses", 1]),
        (changed(["initial", "poses", 1, "vertebra"], "T13"), "unknown-level", ["initial", "poses", 1]),
        (changed(["initial", "poses", 1, "vertebra"], "T10"), "missing-level", ["initial", "poses"]),
        (
            changed(["initial", "poses", 1], {"vertebra": "T9", "position_mm": [0.0] * 3, "rotation": SKEW}),
            "axes-not-rigid",
            ["initial", "poses", 1, "rotation"],
        ),
        (
            changed(
                ["initial", "poses", 1], {"vertebra": "T9", "position_mm": [0.0] * 3, "rotation": MIRROR}
            ),
            "axes-reflected",
            ["initial", "poses", 1, "rotation"],
        ),
        (
            changed(["initial", "poses", 1, "angles_deg"], [0.0, 0.0, 1e300]),
            "angles-out-of-range",
            ["initial", "poses", 1, "angles_deg"],
        ),
        (
            changed(["initial", "poses", 1, "angles_deg"], [90.0, 0.0, 0.0]),
            "angles-out-of-range",
            ["initial", "poses", 1, "angles_deg"],
        ),
        (
            changed(["initial", "poses", 1, "position_mm"], [0.0, -1e300, 0.0]),
            "position-out-of-range",
            ["initial", "poses", 1, "position_mm"],
        ),
        (
            changed(
                ["target"], [{"vertebra": "T9", "angles_deg": [0.0] * 3, "position_mm": [1e300, 0.0, 0.0]}]
            ),
            "invalid-target",
            ["target", 0],
        ),
        (
            changed(["target"], [{"vertebra": "T2", "angles_deg": [0.0] * 3}]),
            "target-of-other-levels",
            ["target", 0, "vertebra"],
        ),
        (
            changed(["target"], [{"vertebra": "T9", "angles_deg": [95.0, 0.0, 0.0]}]),
            "invalid-target",
            ["target", 0],
        ),
        (changed(["target"], []), "invalid-target", ["target"]),
        (changed(["initial"], RADIOGRAPHS), "unknown-radiograph", ["initial", "pa"]),
        (
            changed(["initial"], {"kind": "generic", "cranial": "L5", "caudal": "T1"}),
            "invalid-levels",
            ["initial", "cranial"],
        ),
        (
            changed(["initial"], {"kind": "generic", "cranial": "T9", "caudal": "L5"}),
            "missing-level",
            ["initial"],
        ),
        (changed(["more"], 1), "invalid-request", ["more"]),
    ],
)
def test_a_setup_that_cannot_be_used_is_refused_whole(
    service: Service, surgery: str, setup: dict[str, Any], code: str, place: list[str | int]
) -> None:
    answer = put(service, surgery, setup)
    assert code_of(answer, 422) == code
    assert answer.json()["errors"][0]["loc"] == ["body", *place]
    assert code_of(service.client.get(f"/v1/surgeries/{surgery}/spine"), 409) == "spine-setup-missing"
    assert service.events(surgery) == ["http:surgery:created"]


def test_a_setup_is_replaced_only_by_who_knows_it(service: Service, surgery: str) -> None:
    url = f"/v1/surgeries/{surgery}/spine"
    other = {**SETUP, "target": TARGET}
    early = service.client.put(url, json=SETUP, headers={"If-Match": '"x"'})
    assert code_of(early, 412) == "precondition-failed"
    first = put(service, surgery)
    assert first.headers["etag"] == service.client.get(url).headers["etag"]
    assert code_of(service.client.put(url, json=other), 428) == "precondition-required"
    csv = service.client.put(f"{url}/initial", content=CSV, headers={"Content-Type": "text/csv"})
    assert code_of(csv, 428) == "precondition-required"
    assert service.client.put(url, json=SETUP).status_code == 200
    changed = service.client.put(url, json=other, headers={"If-Match": first.headers["etag"]})
    assert changed.json()["revision"] == 2
    late = service.client.put(url, json=SETUP, headers={"If-Match": first.headers["etag"]})
    assert code_of(late, 412) == "precondition-failed"
    weak = service.client.put(url, json=SETUP, headers={"If-Match": f"W/{changed.headers['etag']}"})
    assert weak.json()["revision"] == 3


def test_a_setup_of_no_surgery_or_of_another_media_type(service: Service, surgery: str) -> None:
    assert code_of(put(service, "none"), 404) == "surgery-not-found"
    url = f"/v1/surgeries/{surgery}/spine"
    answer = service.client.put(url, content=json.dumps(SETUP), headers={"Content-Type": "text/plain"})
    assert code_of(answer, 415) == "unsupported-media-type"


def test_a_marker_clamped_again(service: Service, calibration: str, surgery: str) -> None:
    url = f"/v1/surgeries/{surgery}/spine/rebaselines"
    new = {"vertebra": "T9", "before": "PRE", "after": "POST"}
    assert code_of(service.client.post(url, json=new), 409) == "spine-setup-missing"
    put(service, surgery)
    assert code_of(service.client.post(url, json=new), 422) == "unknown-stage"
    for name in ("PRE", "POST"):
        service.submit(surgery, name, pair(name), calibration)
    before = computed(service, surgery, "POST")
    wrong = [
        ({**new, "vertebra": "L1"}, "reference-clamped-again"),
        ({**new, "vertebra": "T10"}, "not-marked"),
        ({**new, "before": "POST", "after": "PRE"}, "stages-out-of-order"),
        ({**new, "after": "PRE"}, "stages-out-of-order"),
    ]
    for document, code in wrong:
        assert code_of(service.client.post(url, json=document), 422) == code
    answer = service.client.post(url, json=new)
    assert answer.status_code == 201, answer.text
    assert code_of(service.client.post(url, json=new), 409) == "rebaseline-exists"
    stored = service.client.get(f"/v1/surgeries/{surgery}/spine").json()
    assert [item["vertebra"] for item in stored["rebaselines"]] == ["T9"]
    after = computed(service, surgery, "POST")
    moved = {
        vertebra.vertebra: vertebra.angle_deg
        for found in (before, after)
        for vertebra in (found.since_baseline.vertebrae if found.since_baseline else [])
    }
    assert moved["T9"] == pytest.approx(
        0, abs=1e-6
    )  # the spine did not move while the marker was clamped again
    assert moved["T7"] != pytest.approx(0, abs=1)


def test_a_stage_without_the_reference_has_a_reason(service: Service, calibration: str, surgery: str) -> None:
    blank = (pair("PRE")[0], pair("POST")[1])
    service.submit(surgery, "PRE", blank, calibration)
    put(service, surgery)

    def reason() -> str | None:
        answer = spine(service, surgery, "PRE")
        code = code_of(answer, 409)
        return None if code in {"spine-not-ready", "stage-not-measured"} else code

    assert wait_for(reason, "the reason") == "spine-not-available"
    summary = service.client.get(f"/v1/surgeries/{surgery}/summary").json()
    assert "L1" in summary["stages"][0]["spine_reason"]


@pytest.mark.parametrize(
    ("name", "media_type", "start"),
    [
        ("slicer-markups", "application/json", b"{"),
        ("slicer-transforms", "application/zip", b"PK"),
        ("gltf", "model/gltf-binary", b"glTF"),
        ("csv", "application/zip", b"PK"),
        ("json", "application/json", b"{"),
        ("fhir", "application/fhir+json", b"{"),
        ("report-html", "text/html; charset=utf-8", b"<!"),
    ],
)
def test_exports(service: Service, with_spines: str, name: str, media_type: str, start: bytes) -> None:
    answer = service.client.get(f"/v1/surgeries/{with_spines}/exports/{name}")
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == media_type
    assert answer.content.lstrip()[: len(start)].lower() == start.lower()
    assert answer.headers["content-disposition"].startswith('attachment; filename="case-')
    tag = {"If-None-Match": answer.headers["ETag"]}
    again = service.client.get(f"/v1/surgeries/{with_spines}/exports/{name}", headers=tag)
    assert again.status_code == 304


def test_an_export_that_there_is_not(service: Service, with_spines: str) -> None:
    url = f"/v1/surgeries/{with_spines}/exports"
    assert code_of(service.client.get(f"{url}/cd-rom"), 422) == "invalid-request"
    assert code_of(service.client.get(f"{url}/gltf?stage=NEVER"), 422) == "unknown-stage"
    assert code_of(service.client.get(f"{url}/fhir?stage=PRE"), 422) == "stage-not-selectable"
    assert code_of(service.client.get("/v1/surgeries/none/exports/json"), 404) == "surgery-not-found"


def test_a_first_stage_that_fails_and_is_sent_again_after_the_next_is_the_baseline(
    service: Service, calibration: str
) -> None:
    surgery = service.surgery()
    put(service, surgery)
    left, right = pair("PRE")
    broken = left[:1000] + bytes(2000) + left[3000:]
    for name, images in (("PRE", (broken, right)), ("POST", pair("POST")), ("PRE", (left, right))):
        service.finished(service.submit(surgery, name, images, calibration))

    def settled() -> bool:
        after = computed(service, surgery, "POST")
        return after.since_baseline is not None and after.since_baseline.since.name == "PRE"

    wait_for(settled, "the spine of POST after that of PRE")
    assert computed(service, surgery, "PRE").since_baseline is None
    summary = service.client.get(f"/v1/surgeries/{surgery}/summary").json()
    stages = service.client.get(f"/v1/surgeries/{surgery}").json()["stages"]
    assert [(stage["name"], stage["take"]) for stage in summary["stages"]] == [("PRE", 2), ("POST", 1)]
    assert [(stage["name"], stage["take"]) for stage in stages] == [("PRE", 1), ("PRE", 2), ("POST", 1)]
