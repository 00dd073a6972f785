"""A stage that was measured is taken again, or revised; nothing is lost."""

from typing import Any

import pytest

from tests.http.harness import Service, code_of, pair


def retake(
    service: Service, surgery: str, images: tuple[bytes, bytes], calibration: str, name: str = "PRE"
) -> Any:
    files = {"left": ("left", images[0]), "right": ("right", images[1])}
    data = {"name": name, "calibration_id": calibration, "retake": "true"}
    return service.client.post(f"/v1/surgeries/{surgery}/stages", data=data, files=files)


def ended(service: Service, answer: Any) -> str:
    """Return the state in which the job of an accepted request ends."""
    assert answer.status_code == 202, answer.text
    return str(service.finished(answer.headers["location"].removeprefix("/v1/jobs/"))["state"])


def revise(service: Service, surgery: str, **changes: Any) -> Any:
    return service.client.post(f"/v1/surgeries/{surgery}/stages/PRE/revisions", json=changes)


def triads(service: Service, surgery: str, take: int | None = None) -> dict[str, Any]:
    parameters = {} if take is None else {"take": take}
    answer = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/triads", params=parameters)
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


@pytest.fixture
def taken(service: Service, surgery: str, calibration: str) -> str:
    """A surgery whose stage PRE has been measured."""
    assert ended(service, service.send(surgery, "PRE", pair("PRE"), calibration)) == "succeeded"
    return surgery


def test_a_measured_stage_is_taken_again_and_its_takes_are_kept(
    service: Service, taken: str, calibration: str
) -> None:
    first = triads(service, taken)
    refused = service.send(taken, "PRE", pair("POST"), calibration)
    assert code_of(refused, 409) == "stage-exists"
    assert ended(service, retake(service, taken, pair("POST"), calibration)) == "succeeded"
    assert triads(service, taken)["take"] == 2
    assert triads(service, taken, 1) == first
    assert triads(service, taken, 2)["triads"] != first["triads"]
    takes = service.client.get(f"/v1/surgeries/{taken}/stages/PRE/takes").json()
    assert [(take["take"], take["state"]) for take in takes["items"]] == [(2, "succeeded"), (1, "succeeded")]
    images = [
        service.client.get(f"/v1/surgeries/{taken}/stages/PRE/images/left", params=parameters).content
        for parameters in ({}, {"take": "1"})
    ]
    assert images == [pair("POST")[0], pair("PRE")[0]]
    summary = service.client.get(f"/v1/surgeries/{taken}/summary").json()
    assert [(stage["name"], stage["take"]) for stage in summary["stages"]] == [("PRE", 2)]


def test_a_retake_that_fails_leaves_the_results_of_the_take_before(
    service: Service, taken: str, calibration: str
) -> None:
    first = triads(service, taken)
    left = pair("PRE")[0]
    broken = left[:1000] + bytes(2000) + left[3000:]
    assert ended(service, retake(service, taken, (broken, pair("PRE")[1]), calibration)) == "failed"
    assert triads(service, taken) == first
    latest = service.client.get(f"/v1/surgeries/{taken}/stages/PRE").json()
    assert (latest["take"], latest["state"]) == (2, "failed")
    summary = service.client.get(f"/v1/surgeries/{taken}/summary").json()
    assert summary["stages"][0]["take"] == 1
    missing = service.client.get(f"/v1/surgeries/{taken}/stages/PRE/triads", params={"take": "2"})
    assert code_of(missing, 409) == "stage-not-measured"


def test_a_retake_with_the_same_pair_is_the_take_that_is_there(
    service: Service, taken: str, calibration: str
) -> None:
    again = retake(service, taken, pair("PRE"), calibration)
    assert (again.status_code, again.json()["take"]) == (200, 1)


def test_the_same_pair_at_another_time_is_refused_or_the_next_take(
    service: Service, surgery: str, calibration: str
) -> None:
    def send(**parts: str) -> Any:
        left, right = pair("PRE")
        data = {"name": "PRE", "calibration_id": calibration, **parts}
        files = {"left": ("left", left), "right": ("right", right)}
        return service.client.post(f"/v1/surgeries/{surgery}/stages", data=data, files=files)

    hour = "2026-01-05T2{}:00:00Z".format
    assert ended(service, send(captured_at=hour(0))) == "succeeded"
    for same in ({}, {"captured_at": hour(0)}, {"captured_at": "2026-01-05T21:00:00+01:00"}):
        again = send(**same, retake="true")
        assert (again.status_code, again.json()["captured_at"]) == (200, hour(0))
    exposed = {"left_exposed_at": hour(0), "right_exposed_at": hour(0)}
    for other in ({"captured_at": hour(1)}, exposed):
        assert code_of(send(**other), 409) == "stage-exists"
    taken = send(captured_at=hour(1), retake="true")
    assert ended(service, taken) == "succeeded"
    assert (taken.json()["take"], taken.json()["captured_at"]) == (2, hour(1))


def test_a_stage_in_work_is_not_taken_again(idle: Service) -> None:
    surgery, calibration = idle.surgery(), idle.calibration()
    job = idle.submit(surgery, "PRE", pair("PRE"), calibration)
    refused = retake(idle, surgery, pair("POST"), calibration)
    assert code_of(refused, 409) == "stage-exists"
    assert refused.headers["location"] == f"/v1/jobs/{job}"
    revision = revise(idle, surgery, kind="measure", take=1)
    assert code_of(revision, 409) == "stage-exists"


def test_an_unknown_take_is_named(service: Service, taken: str) -> None:
    for part in ("", "/triads", "/features", "/images/left"):
        answer = service.client.get(f"/v1/surgeries/{taken}/stages/PRE{part}", params={"take": "7"})
        assert code_of(answer, 404) == "take-not-found"


def test_labels_are_changed_and_a_triad_is_removed(service: Service, taken: str) -> None:
    before = triads(service, taken)
    assert [triad["label"] for triad in before["triads"]] == ["L1", "T11", "T9", "T7"]
    edits = {
        "kind": "edit",
        "take": 1,
        "labels": [{"triad": 0, "label": "L1"}, {"triad": 1, "label": "T9"}, {"triad": 2, "label": None}],
        "removed": [3],
    }
    answer = revise(service, taken, **edits)
    assert ended(service, answer) == "succeeded"
    after = triads(service, taken)
    assert [triad["label"] for triad in after["triads"]] == ["L1", "T9", None]
    assert after["triads"][1]["position_mm"] == before["triads"][1]["position_mm"]
    assert after["triads"][2]["label_reason"]
    assert after["take"] == 2
    assert after["revision"]["of_take"] == 1
    assert after["revision"]["changes"] == {**edits, "centres": []}
    assert after["revision"]["by"].endswith("test")
    assert triads(service, taken, 1) == before
    assert (
        answer.json()["created_at"]
        == service.client.get(f"/v1/surgeries/{taken}/stages/PRE", params={"take": "1"}).json()["created_at"]
    )
    undone = revise(
        service,
        taken,
        kind="edit",
        take=2,
        labels=[{"triad": 1, "label": "T11"}, {"triad": 2, "label": "T9"}],
    )
    assert ended(service, undone) == "succeeded"
    assert [triad["label"] for triad in triads(service, taken)["triads"]] == ["L1", "T11", "T9"]


def test_edits_carry_the_actor(service: Service, taken: str) -> None:
    answer = revise(service, taken, kind="edit", take=1, removed=[0])
    assert ended(service, answer) == "succeeded"
    assert "http:stage:revised" in service.events(answer.json()["id"])


def test_images_are_measured_again_with_other_parameters(service: Service, taken: str) -> None:
    before = triads(service, taken)
    changes = {"search": {"identification": {"tolerance_mm": 4.5}}, "detection": {"max_features": 200}}
    assert ended(service, revise(service, taken, kind="measure", take=1, parameters=changes)) == "succeeded"
    after = triads(service, taken)
    assert after["take"] == 2
    assert after["parameters"]["search"]["identification"]["tolerance_mm"] == 4.5
    assert after["parameters"]["detection"]["max_features"] == 200
    assert before["parameters"]["detection"]["max_features"] != 200
    assert {flag["code"] for flag in after["flags"]} >= {"parameters-changed"}
    again = revise(service, taken, kind="measure", take=2, templates=before["templates"])
    assert ended(service, again) == "succeeded"
    assert triads(service, taken)["triads"] == before["triads"]
    assert triads(service, taken)["flags"] == before["flags"]


def test_a_value_that_cannot_be_used_fails_the_revision_alone(service: Service, taken: str) -> None:
    before = triads(service, taken)
    answer = revise(service, taken, kind="measure", take=1, parameters={"detection": {"sigma_px": [0.1]}})
    job = service.finished(answer.headers["location"].removeprefix("/v1/jobs/"))
    assert job["error"]["type"] == "urn:spinewatch:problem:invalid-parameter"
    answer = revise(service, taken, kind="measure", take=1, templates="1066")
    job = service.finished(answer.headers["location"].removeprefix("/v1/jobs/"))
    assert job["error"]["type"] == "urn:spinewatch:problem:unknown-templates"
    assert triads(service, taken) == before


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"kind": "edit", "take": 1}, "invalid-request"),
        ({"kind": "edit", "take": 1, "removed": [0, 0]}, "invalid-request"),
        ({"kind": "edit", "take": 1, "removed": [4]}, "unknown-triad"),
        ({"kind": "edit", "take": 1, "labels": [{"triad": 9, "label": "T9"}]}, "unknown-triad"),
        ({"kind": "edit", "take": 1, "labels": [{"triad": 0, "label": "T8"}]}, "invalid-label"),
        ({"kind": "edit", "take": 1, "labels": [{"triad": 0, "label": "T9"}]}, "invalid-label"),
        ({"kind": "measure", "take": 1, "parameters": {"detektion": {}}}, "invalid-parameter"),
        ({"kind": "measure", "take": 1, "parameters": {"detection": 3}}, "invalid-parameter"),
        ({"kind": "measure", "take": 1, "parameters": {"ball_diameter_mm": -1}}, "invalid-parameter"),
        (
            {"kind": "measure", "take": 1, "parameters": {"detection": {"max_features": "many"}}},
            "invalid-parameter",
        ),
        (
            {"kind": "measure", "take": 1, "parameters": {"detection": {"quality": {"n_strips": 0}}}},
            "invalid-parameter",
        ),
        ({"kind": "draw", "take": 1}, "invalid-request"),
    ],
)
def test_a_revision_that_does_not_fit_is_refused(
    service: Service, measured: str, changes: dict[str, Any], code: str
) -> None:
    assert code_of(revise(service, measured, **changes), 422) == code


def test_only_the_take_whose_results_count_is_revised(service: Service, measured: str) -> None:
    assert code_of(revise(service, measured, kind="measure", take=2), 409) == "take-superseded"
