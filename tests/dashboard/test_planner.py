"""The planner on the page: its figures are those of the API, and its address contains the plan."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Page, expect

from tests.dashboard.conftest import Visit
from tests.dashboard.numbers import fixed
from tests.dashboard.visitor import Visitor
from tests.http.harness import Service


def plan(service: Service, **query: Any) -> dict[str, Any]:
    answer = service.client.get("/v1/plans/accuracy", params=query)
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


def show(visitor: Visitor, address: str = "") -> Page:
    visitor.open(f"/planner{address}")
    expect(visitor.page.get_by_role("heading", level=1, name="Planner")).to_be_visible()
    return visitor.page


def check_figures(page: Page, name: str, expected: dict[str, Any]) -> None:
    """Check that the figures of a design are those of a plan."""
    expect(page.locator(f"[data-plan='{name}-cobb']")).to_have_text(f"{fixed(expected['cobb_sd_deg'], 2)}°")
    for axis, key in enumerate(("sd-x", "sd-y", "sd-z")):
        largest = max(triad["position_sd_mm"][axis] for triad in expected["triads"])
        expect(page.locator(f"[data-plan='{name}-{key}']")).to_contain_text(fixed(largest, 3))
    difference = fixed(expected["marker"]["difference_mm"], 2)
    expect(page.locator(f"[data-plan='{name}-difference']")).to_contain_text(difference)
    for triad in expected["triads"]:
        row = page.locator(f"[data-vertebra='{name}-{triad['vertebra']}'] td")
        expect(row.nth(0)).to_have_text(fixed(triad["position_sd_mm"][0], 3))
        expect(row.nth(4)).to_have_text(fixed(triad["out_of_plane_sd_deg"], 2))


def test_the_figures_are_those_of_the_api_and_follow_the_form(service: Service, visit: Visit) -> None:
    with visit(service) as visitor:
        page = show(visitor)
        check_figures(page, "A", plan(service))
        page.get_by_label("Baseline, mm").first.fill("600")
        page.get_by_label("Vertebrae, the reference first").fill("L1, T12, T10")
        check_figures(page, "A", plan(service, baseline_mm=600, levels="L1,T12,T10"))
        page.get_by_label("Radius of the disc, mm").fill("20")
        check_figures(page, "A", plan(service, baseline_mm=600, levels="L1,T12,T10", disc_radius_mm=20))
        visitor.screenshot("planner", full_page=True)


def test_two_designs_are_compared_and_the_address_contains_both(service: Service, visit: Visit) -> None:
    calibration = service.calibration()
    with visit(service) as visitor:
        page = show(visitor, f"?calibration_id={calibration}")
        check_figures(page, "A", plan(service, calibration_id=calibration))
        page.get_by_role("button", name="At the ceiling").click()
        heading = page.get_by_role("heading", name="Design B")
        expect(heading).to_be_visible()
        focal = page.get_by_role("form", name="Design B").get_by_label("Focal length, mm").input_value()
        rig = plan(service, calibration_id=calibration)["rig"]
        query = {
            "baseline_mm": 1100,
            "camera_height_mm": 2000,
            "focal_length_mm": focal,
            "image_width_px": rig["image_size_px"][0],
            "image_height_px": rig["image_size_px"][1],
            "pixel_width_mm": rig["pixel_size_mm"][0],
            "pixel_height_mm": rig["pixel_size_mm"][1],
        }
        check_figures(page, "B", plan(service, **query))
        assert 0.97 < plan(service, **query)["rig"]["pixel_mm"] / rig["pixel_mm"] < 1.03
        address = page.evaluate("location.href")
        visitor.screenshot("planner-comparison", full_page=True)
    with visit(service) as other:
        other.page.goto(address)
        check_figures(other.page, "A", plan(service, calibration_id=calibration))
        check_figures(other.page, "B", plan(service, **query))


def test_what_cannot_be_planned_is_said_and_gives_no_number(service: Service, visit: Visit) -> None:
    hostile = "<img src=x onerror=alert(1)>"
    with visit(service) as visitor:
        visitor.tolerated = ("status of 422",)
        page = show(visitor)
        check_figures(page, "A", plan(service))
        page.get_by_label("Vertebrae, the reference first").fill(hostile)
        expect(page.get_by_text("name vertebrae along the spine")).to_be_visible()
        expect(page.locator("[data-plan]")).to_have_count(0)
        page.get_by_label("Vertebrae, the reference first").fill("L1,T9,T11")
        expect(page.get_by_role("alert")).to_contain_text("not in the order of the spine")
        expect(page.locator("[data-plan]")).to_have_count(0)
