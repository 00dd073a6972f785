"""Calibrations on the page: the list, one calibration with residuals and drift, and new ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import expect

from contract.key import Scope
from tests.dashboard.conftest import Visit
from tests.dashboard.numbers import fixed
from tests.dashboard.visitor import Visitor
from tests.http.harness import BOARDS, RIG, SAMPLE, Service, pair

HOSTILE = "<img src=x onerror=alert(1)> cart"


@pytest.fixture(scope="module")
def checked(service: Service, calibration: str) -> list[dict[str, Any]]:
    """The checks of the calibration by three stages that were measured with it, newest first."""
    surgery = service.surgery()
    for name in ("PRE", "INTER", "POST"):
        job = service.submit(surgery, name, pair(name), calibration)
        assert service.finished(job)["state"] == "succeeded"
    answer = service.client.get(f"/v1/calibrations/{calibration}/checks", params={"limit": 200})
    items: list[dict[str, Any]] = answer.json()["items"]
    assert len(items) == 3
    return items


@pytest.fixture
def detail(service: Service, calibration: str) -> dict[str, Any]:
    document: dict[str, Any] = service.client.get(f"/v1/calibrations/{calibration}").json()
    return document


def opened(visitor: Visitor, calibration: str) -> None:
    visitor.open(f"/calibrations/{calibration}")
    expect(visitor.page.get_by_role("heading", name="State")).to_be_visible()
    expect(visitor.page.locator(".loading")).to_have_count(0)


def test_the_list_has_age_accuracy_and_flags_or_the_reason(
    service: Service, visit: Visit, calibration: str, detail: dict[str, Any]
) -> None:
    given = service.calibration({**RIG, "name": HOSTILE})
    with visit(service) as visitor:
        visitor.open("/calibrations")
        row = visitor.page.locator(f"tr[data-calibration='{calibration}']")
        sd = detail["report"]["leave_one_out"]["sd_mm"]
        expect(row.locator("td.number")).to_have_text([fixed(value, 3) for value in sd])
        expect(row).to_contain_text("none")
        elsewhere = visitor.page.locator(f"tr[data-calibration='{given}']")
        expect(elsewhere.get_by_role("link")).to_have_text(HOSTILE)
        expect(elsewhere).to_contain_text("at least")
        expect(elsewhere.locator("td.number").first).to_contain_text("calibrated elsewhere")
        elsewhere.get_by_role("link").click()
        expect(visitor.page.get_by_role("heading", level=1)).to_have_text(HOSTILE)
        expect(visitor.page.get_by_text("It has no images, residuals or accuracy here")).to_be_visible()


def test_accuracy_is_that_of_the_report_with_its_limits(
    service: Service, visit: Visit, calibration: str, detail: dict[str, Any]
) -> None:
    report = detail["report"]
    with visit(service) as visitor:
        opened(visitor, calibration)
        panel = visitor.page.get_by_role("region", name="Accuracy of control points")
        for shot in report["shots"]:
            cells = panel.locator(f"tr[data-shot='shot {shot['number']}'] td.number")
            expect(cells.nth(0)).to_have_text(str(shot["reconstructed"]))
            for axis in range(3):
                expect(cells.nth(1 + axis)).to_have_text(
                    f"{fixed(shot['sd_mm'][axis], 3)} ({fixed(shot['mean_mm'][axis], 3)})"
                )
            if shot["used"]:
                expect(cells.nth(4)).to_have_text(fixed(shot["image_rms_left_px"], 3))
            else:
                expect(cells.nth(4)).to_contain_text("were not adjusted")
        flagged, refused = report["limits"]["reconstruction_mm"]
        expect(panel.get_by_role("row", name="flagged above")).to_contain_text(fixed(flagged, 2))
        expect(panel.get_by_role("row", name="refused above")).to_contain_text(fixed(refused, 2))


def test_residuals_are_drawn_enlarged_by_the_factor_that_is_stated(
    service: Service, visit: Visit, calibration: str, detail: dict[str, Any]
) -> None:
    used, held_out = detail["report"]["shots"]
    with visit(service) as visitor:
        opened(visitor, calibration)
        panel = visitor.page.get_by_role("region", name="Image residuals")
        stated = panel.get_by_text("Vectors are measured less computed").inner_text()
        factor = float(stated.split("enlarged ")[1].split()[0])
        assert factor >= 1
        plot = panel.get_by_role("img", name="left image of shot 1")
        lines = plot.locator("g:first-of-type line")
        expect(lines).to_have_count(len(used["points"]["left"]))
        for i, point in enumerate(used["points"]["left"]):
            x1, y1, x2, y2 = (
                float(lines.nth(i).get_attribute(name) or "nan") for name in ("x1", "y1", "x2", "y2")
            )
            assert [x1, y1] == [point["u_px"], point["v_px"]]
            assert [(x2 - x1) / factor, (y2 - y1) / factor] == pytest.approx(point["residual_px"], abs=1e-9)
        panel.get_by_text("Points of shot 1 as a table").click()
        for point in used["points"]["left"]:
            cells = panel.locator(f"tr[data-point='{point['id']}'] td.number")
            expect(cells.nth(0)).to_have_text(fixed(point["residual_px"][0], 3))
            expect(cells.nth(1)).to_have_text(fixed(point["residual_px"][1], 3))
        panel.get_by_role("combobox", name="Shot", exact=True).select_option(str(held_out["number"]))
        expect(panel).to_contain_text("held out: its image points were found but not adjusted")
        expect(panel.get_by_role("img", name="left image of shot 2").locator("line")).to_have_count(0)


def test_the_drift_is_a_control_chart_with_the_numbers_of_the_checks(
    service: Service, visit: Visit, calibration: str, checked: list[dict[str, Any]]
) -> None:
    with visit(service) as visitor:
        opened(visitor, calibration)
        panel = visitor.page.get_by_role("region", name="Drift of the right camera")
        for check in checked:
            cells = panel.locator(f"tr[data-stage='{check['stage']}'] td.number")
            expect(cells.nth(0)).to_have_text(fixed(check["age_days"], 1))
            drift = check["drift"]
            for axis in range(3):
                rotation, sd = drift["rotation_deg"][axis], drift["rotation_sd_deg"][axis]
                expect(cells.nth(1 + axis)).to_have_text(f"{fixed(rotation, 3)} ± {fixed(sd, 3)}°")
        charts = panel.get_by_role("img", name="of the right camera by stage")
        expect(charts).to_have_count(7)
        expect(charts.first).to_have_attribute(
            "aria-label", "Rotation about x of the right camera by stage, 3 stages, none out of control."
        )
        expect(panel.locator("figure canvas").first).to_be_visible()


def test_a_camera_that_moved_is_out_of_control(service: Service, visit: Visit) -> None:
    bumped = json.loads(json.dumps(RIG))
    bumped["right"]["rotation_deg"][2] += 0.3
    moved, surgery = service.calibration(bumped), service.surgery()
    service.finished(service.submit(surgery, "PRE", pair("PRE"), moved))
    checks = service.client.get(f"/v1/calibrations/{moved}/checks").json()["items"]
    assert "calibration-drift" in [flag["code"] for flag in checks[0]["flags"]]
    with visit(service) as visitor:
        opened(visitor, moved)
        panel = visitor.page.get_by_role("region", name="Drift of the right camera")
        expect(panel.get_by_text("The rig had moved in 1 of 1 stages: PRE")).to_be_visible()
        if checks[0]["drift"] is not None:
            expect(
                panel.get_by_role("img", name="out of control: PRE (beyond the 99.7% limit").first
            ).to_be_visible()


def test_a_rig_is_stored_as_it_is(service: Service, visit: Visit, tmp_path: Path) -> None:
    with visit(service) as visitor:
        page = visitor.page
        visitor.tolerated = ("422",)
        visitor.open("/calibrations")
        wrong = tmp_path / "wrong.json"
        wrong.write_text(json.dumps({**RIG, "left": {**RIG["left"], "focal_length_mm": -1}}))
        form = page.get_by_role("region", name="Store a rig calibrated elsewhere")
        form.get_by_label("Rig file").set_input_files(wrong)
        form.get_by_role("button", name="Store the rig").click()
        expect(form.get_by_role("alert")).to_contain_text("focal_length_mm")
        form.get_by_label("Rig file").set_input_files(SAMPLE / "rig.json")
        form.get_by_role("button", name="Store the rig").click()
        expect(page.get_by_role("heading", level=1)).to_have_text(RIG["name"])
        expect(page.locator("tr[data-parameter='f'] td.number").first).to_have_text(
            str(RIG["left"]["focal_length_mm"])
        )


def test_shots_become_a_calibration_with_progress(service: Service, visit: Visit) -> None:
    files = [BOARDS / trial / f"{side}.png" for trial in ("C", "F") for side in ("left", "right")]
    with visit(service) as visitor:
        page = visitor.page
        visitor.open("/calibrations")
        form = page.get_by_role("region", name="Calibrate from shots of a control field")
        form.get_by_role("button", name="Calibrate").click()
        expect(form.get_by_role("alert")).to_contain_text("Name the rig")
        form.get_by_label("Name of the rig").fill("cart of the page")
        form.get_by_label("Images, left and right of each shot").set_input_files(files[:2])
        expect(form.get_by_label("Left image of pair 1").locator("option:checked")).to_have_text("left.png")
        expect(form.get_by_role("alert")).to_contain_text("Leave at least one shot to calibrate with")
        form.get_by_label("Shots held out for verification").fill("0")
        expect(form.get_by_role("alert")).to_have_count(0)
        form.get_by_role("button", name="Calibrate").click()
        form.get_by_role("link", name="Show the calibration").click()
        expect(page.get_by_role("heading", level=1)).to_have_text("cart of the page")
        visitor.open("/calibrations")
        expect(page.get_by_role("link", name="cart of the page")).to_be_visible()


def test_shots_that_show_no_control_field_say_so(service: Service, visit: Visit) -> None:
    with visit(service) as visitor:
        page = visitor.page
        visitor.open("/calibrations")
        form = page.get_by_role("region", name="Calibrate from shots of a control field")
        form.get_by_label("Name of the rig").fill("no board")
        form.get_by_label("Shots held out for verification").fill("0")
        form.get_by_label("Images, left and right of each shot").set_input_files(
            [SAMPLE / "PRE" / f"{side}.png" for side in ("left", "right")]
        )
        form.get_by_role("button", name="Calibrate").click()
        expect(form.get_by_role("alert")).to_contain_text("shot 1")


def test_who_may_not_calibrate_is_not_asked_to(service: Service, visit: Visit, calibration: str) -> None:
    reader = service.make_key(Scope.STAGE_READ)
    with visit(service, signed_in=False) as visitor:
        visitor.page.goto(f"{visitor.url}/#key={reader}")
        visitor.open("/calibrations")
        expect(visitor.page.locator(f"tr[data-calibration='{calibration}']")).to_be_visible()
        expect(visitor.page.get_by_role("button", name="Calibrate")).to_have_count(0)
