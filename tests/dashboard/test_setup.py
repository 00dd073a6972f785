"""The setup of a spine on the page: by keyboard alone, from files, and with two people at it."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.dashboard.conftest import Visit
from tests.dashboard.sample import configure
from tests.dashboard.visitor import Visitor
from tests.http.harness import Service

POSES = """vertebra,x_mm,y_mm,z_mm,coronal_deg,sagittal_deg,axial_deg
T7,0,2,180,12.5,20,4
T9,0,8,120,4,12,8
T11,0,4,60,-9,2,5
L1,0,0,0,-14,-4,0
"""


@pytest.fixture
def surgery(service: Service) -> str:
    return service.surgery()


_NO_SETUP = ("409",)
"""What a browser reports of the answer that a surgery has no setup of the spine yet, which the page shows as a form."""


def show(visitor: Visitor, surgery: str) -> Page:
    visitor.open(f"/surgeries/{surgery}/setup")
    expect(visitor.page.get_by_role("button", name="Store the setup")).to_be_visible()
    return visitor.page


def stored(service: Service, surgery: str) -> dict[str, Any]:
    answer = service.client.get(f"/v1/surgeries/{surgery}/spine")
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


def test_a_setup_is_stored_by_keyboard_alone(service: Service, visit: Visit, surgery: str) -> None:
    with visit(service) as visitor:
        visitor.tolerated = _NO_SETUP
        page = show(visitor, surgery)
        visitor.tab_to(page.get_by_label("To the head"))
        page.keyboard.press("ArrowDown")  # from +X to -X
        expect(page.get_by_label("To the head")).to_have_value("-x")
        visitor.tab_to(page.get_by_label("To the patient’s left"))
        page.keyboard.press("ArrowDown")
        expect(page.get_by_label("To the patient’s left")).to_have_value("-y")
        visitor.tab_to(page.get_by_label("Most cranial vertebra"))
        page.keyboard.press("ArrowDown")
        visitor.tab_to(page.get_by_role("button", name="Store the setup"))
        page.keyboard.press("Enter")
        expect(page.get_by_text("stored as revision 1")).to_be_visible()
        revision = page.locator("[data-revision='1']")
        expect(revision).to_contain_text("by ")
        expect(revision).to_contain_text("test")
    setup = stored(service, surgery)["setup"]
    assert setup["patient_axes"] == {
        "kind": "directions",
        "cephalad": "-x",
        "left": "-y",
        "direction_sd_deg": 3.0,
    }
    assert setup["initial"] == {"kind": "generic", "cranial": "T2", "caudal": "L5"}


def test_poses_and_a_target_come_from_files(service: Service, visit: Visit, surgery: str) -> None:
    with visit(service) as visitor:
        visitor.tolerated = _NO_SETUP
        page = show(visitor, surgery)
        page.get_by_label("Poses from a file or typed in").check()
        expect(page.get_by_role("button", name="Store the setup")).to_be_disabled()
        file = page.get_by_label("CSV or JSON file")
        file.set_input_files(
            {"name": "poses.csv", "mimeType": "text/csv", "buffer": b"vertebra,x_mm\nT7,1\n"}
        )
        expect(page.get_by_role("alert")).to_contain_text("The head line lacks y_mm")
        file.set_input_files({"name": "poses.csv", "mimeType": "text/csv", "buffer": POSES.encode()})
        page.get_by_label("or typed", exact=True).fill(
            "vertebra,coronal_deg,sagittal_deg,axial_deg\nT9,0,12,0"
        )
        page.get_by_role("button", name="Store the setup").click()
        expect(page.get_by_text("stored as revision 1")).to_be_visible()
        visitor.screenshot("setup")
    setup = stored(service, surgery)["setup"]
    assert [pose["vertebra"] for pose in setup["initial"]["poses"]] == ["T7", "T9", "T11", "L1"]
    assert setup["initial"]["poses"][0]["angles_deg"] == [12.5, 20, 4]
    assert setup["target"] == [{"vertebra": "T9", "angles_deg": [0, 12, 0], "position_mm": None}]


def test_directions_that_contradict_each_other_cannot_be_stored(
    service: Service, visit: Visit, surgery: str
) -> None:
    with visit(service) as visitor:
        visitor.tolerated = _NO_SETUP
        page = show(visitor, surgery)
        page.get_by_label("To the patient’s left").select_option("-x")
        expect(page.get_by_text("lies along that to the head")).to_be_visible()
        expect(page.get_by_role("button", name="Store the setup")).to_be_disabled()


@pytest.mark.parametrize("is_first", [True, False])
def test_nobody_overwrites_the_setup_of_somebody_else(
    service: Service, visit: Visit, surgery: str, is_first: bool
) -> None:
    if not is_first:
        configure(service, surgery)
    with visit(service) as visitor:
        visitor.tolerated = (*_NO_SETUP, "status of 412", "status of 428")
        page = show(visitor, surgery)
        page.get_by_label("To the patient’s left").select_option("-y")
        url = f"/v1/surgeries/{surgery}/spine"
        theirs = {
            "patient_axes": {"kind": "directions", "cephalad": "+x", "left": "+y"},
            "initial": {"kind": "generic", "cranial": "T4", "caudal": "L2"},
        }
        headers = {} if is_first else {"If-Match": service.client.get(url).headers["ETag"]}
        assert service.client.put(url, json=theirs, headers=headers).status_code == 200
        page.get_by_role("button", name="Store the setup").click()
        conflict = page.get_by_role("alert").filter(has_text="meanwhile")
        expect(conflict).to_contain_text("T4 to L2")
        assert stored(service, surgery)["setup"]["initial"]["cranial"] == "T4"
        page.get_by_role("button", name="Carry my change over to theirs").click()
        page.get_by_role("button", name="Store the setup").click()
        expect(page.get_by_text("stored as revision")).to_be_visible()
    setup = stored(service, surgery)["setup"]
    assert setup["patient_axes"]["left"] == "-y"
    if not is_first:  # what only they changed is kept
        assert setup["initial"]["cranial"] == "T4"


def test_a_marker_that_was_clamped_again_is_stated(service: Service, visit: Visit, measured: str) -> None:
    with visit(service) as visitor:
        visitor.tolerated = _NO_SETUP
        page = show(visitor, measured)
        page.get_by_label("Vertebra", exact=True).select_option("T9")
        page.get_by_label("Last stage before").select_option("PRE")
        page.get_by_label("First stage after").select_option("INTER")
        page.get_by_role("button", name="State it").click()
        expect(page.get_by_text("T9: between PRE and INTER")).to_be_visible()
    known = stored(service, measured)["rebaselines"]
    assert [(item["vertebra"], item["before"], item["after"]) for item in known] == [("T9", "PRE", "INTER")]
