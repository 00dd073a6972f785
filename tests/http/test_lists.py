"""Adding and listing calibrations and surgeries."""

from typing import Any

import pytest

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


@pytest.mark.parametrize("kind", ["calibrations", "surgeries"])
def test_pages_hold_everything_once_oldest_first(service: Service, kind: str) -> None:
    def page(limit: int, offset: int) -> dict[str, Any]:
        document: dict[str, Any] = service.client.get(
            f"/v1/{kind}", params={"limit": limit, "offset": offset}
        ).json()
        return document

    before = page(1, 0)["total"]
    ids = [service.calibration() if kind == "calibrations" else service.surgery() for _ in range(5)]
    pages = [page(2, before + offset) for offset in (0, 2, 4, 6)]
    assert [[item["id"] for item in page["items"]] for page in pages] == [ids[:2], ids[2:4], ids[4:], []]
    assert {page["total"] for page in pages} == {before + 5}


def test_a_surgery_lists_its_stages_and_their_states(service: Service, measured: str) -> None:
    shown = service.client.get(f"/v1/surgeries/{measured}").json()
    assert [(stage["name"], stage["state"]) for stage in shown["stages"]] == [
        ("PRE", "succeeded"),
        ("INTER", "succeeded"),
        ("POST", "succeeded"),
    ]
    page = service.client.get(f"/v1/surgeries/{measured}/stages", params={"limit": 2, "offset": 1}).json()
    assert [stage["name"] for stage in page["items"]] == ["INTER", "POST"]
    assert page["total"] == 3
