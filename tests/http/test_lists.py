"""Adding and listing calibrations and surgeries."""

from tests.http.harness import RIG, Service


def test_a_calibration_comes_back_as_it_was_given(service: Service) -> None:
    created = service.client.post("/v1/calibrations", json=RIG)
    assert created.status_code == 201
    shown = service.client.get(created.headers["Location"]).json()
    assert shown == created.json()
    assert shown["rig"] == RIG
    assert shown["name"] == RIG["name"]


def test_a_surgery_comes_back_as_it_was_given(service: Service) -> None:
    body = {"reference": "2026-0417", "vertebrae": ["L1", "T11"], "reference_vertebra": "T11"}
    created = service.client.post("/v1/surgeries", json=body)
    assert created.status_code == 201
    shown = service.client.get(created.headers["Location"]).json()
    assert shown == created.json()
    assert {key: shown[key] for key in body} == body
    assert shown["spine_axis"] == "auto"
    assert shown["stages"] == []


def test_a_surgery_lists_its_stages_and_their_states(service: Service, measured: str) -> None:
    shown = service.client.get(f"/v1/surgeries/{measured}").json()
    assert [(stage["name"], stage["state"]) for stage in shown["stages"]] == [
        ("PRE", "succeeded"),
        ("INTER", "succeeded"),
        ("POST", "succeeded"),
    ]
    page = service.client.get(f"/v1/surgeries/{measured}/stages", params={"limit": 2}).json()
    assert [stage["name"] for stage in page["items"]] == ["POST", "INTER"]
    assert page["total"] == 3
