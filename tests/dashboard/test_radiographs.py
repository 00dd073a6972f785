"""Radiographs on the page: upload, landmarks by mouse and keyboard, the fit, and saving it."""

from __future__ import annotations

import json
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, Request, expect

from tests.dashboard.conftest import Visit
from tests.dashboard.films import SPACING, Films, films
from tests.dashboard.numbers import fixed
from tests.dashboard.sample import configure
from tests.dashboard.visitor import Visitor
from tests.http.harness import Service

LEVELS = ("T7", "T8", "T9", "T10", "T11", "T12", "L1")
ORDER = {
    "pa": (
        "superior_left",
        "superior_right",
        "inferior_left",
        "inferior_right",
        "pedicle_left",
        "pedicle_right",
    ),
    "lateral": ("superior_anterior", "superior_posterior", "inferior_anterior", "inferior_posterior"),
}
NAMES = {"pa": "PA radiograph", "lateral": "lateral radiograph"}


@pytest.fixture(scope="module")
def pair() -> Films:
    return films(LEVELS)


@pytest.fixture
def surgery(service: Service) -> str:
    surgery = service.surgery()
    configure(service, surgery)
    return surgery


def uploaded(service: Service, surgery: str, pair: Films) -> dict[str, str]:
    """Upload both images over HTTP, and return their identifiers."""
    found = {}
    for view, side in (("pa", "left_on"), ("lateral", "anterior_on")):
        row, column = SPACING[view]
        data = {
            "view": view,
            "pixel_spacing_mm": f"{row},{column}",
            side: "left" if view == "pa" else "right",
        }
        answer = service.client.post(
            f"/v1/surgeries/{surgery}/radiographs", data=data, files={"image": ("film", pair.images[view])}
        )
        assert answer.status_code == 201, answer.text
        found[view] = str(answer.json()["id"])
    return found


def show(visitor: Visitor, surgery: str) -> Page:
    visitor.open(f"/surgeries/{surgery}/radiographs")
    expect(visitor.page.get_by_role("heading", level=1, name="Radiographs")).to_be_visible()
    return visitor.page


def film(page: Page, view: str) -> Locator:
    return page.get_by_role("application", name=NAMES[view])


def click(page: Page, view: str, point: list[float]) -> None:
    """Click a place of a radiograph."""
    frame = film(page, view)
    frame.scroll_into_view_if_needed()
    box = frame.bounding_box()
    assert box is not None
    x, y, scale = frame.locator("> img").evaluate(
        "image => { const m = new DOMMatrix(getComputedStyle(image).transform); return [m.e, m.f, m.a]; }"
    )
    # the frame has a border of a pixel
    page.mouse.click(box["x"] + 1 + x + scale * (point[0] + 0.5), box["y"] + 1 + y + scale * (point[1] + 0.5))


def add_common_points(page: Page, common: list[dict[str, Any]]) -> None:
    page.get_by_label("Seen as").select_option("object")
    for point in common:
        page.get_by_label("Name", exact=True).fill(point["name"])
        for axis, value in zip("xyz", point["object_mm"], strict=True):
            page.get_by_label(f"{axis}, mm", exact=True).fill(str(value))
        page.get_by_label("sd, mm", exact=True).fill("0.5")
        page.get_by_role("button", name="Add", exact=True).click()


def current(page: Page) -> Locator:
    return page.locator(".now-name")


def test_landmarks_of_a_pair_are_clicked_fitted_and_saved(
    service: Service, visit: Visit, surgery: str, pair: Films
) -> None:
    sent: list[Request] = []
    with visit(service) as visitor:
        page = show(visitor, surgery)
        page.on("request", lambda request: sent.append(request) if request.url.endswith("/fit") else None)
        for view in ("pa", "lateral"):
            form = page.get_by_role("form", name="PA radiograph" if view == "pa" else "Lateral radiograph")
            form.get_by_label("File with the head at its top").set_input_files(
                {"name": "Erika Mustermann.png", "mimeType": "image/png", "buffer": pair.images[view]}
            )
            form.get_by_label("Distance of rows, mm").fill(str(SPACING[view][0]))
            form.get_by_label("Distance of columns, mm").fill(str(SPACING[view][1]))
            form.get_by_role("button", name="Upload").click()
            expect(form).to_have_count(0)
        expect(film(page, "pa")).to_be_visible()
        add_common_points(page, pair.document["common"])
        page.get_by_label("Landmark sd per axis, px").fill("4")
        page.get_by_label("Landmark sd per axis, px").press("Tab")
        for view in ("pa", "lateral"):
            for vertebra in pair.document["vertebrae"]:
                for name in ORDER[view]:
                    click(page, view, vertebra[view][name])
            for point in pair.document["common"]:
                click(page, view, point[view])
        expect(current(page)).to_have_text("All landmarks are placed")
        rows = page.locator("[data-residual]")
        expect(rows).to_have_count(len(pair.document["common"]))
        visitor.screenshot("radiographs")
        answer = service.client.post(
            f"/v1/surgeries/{surgery}/radiographs/fit", json=json.loads(sent[-1].post_data or "")
        )
        fit = answer.json()
        for residual in fit["residuals"]:
            row = page.locator(f"[data-residual='{residual['name']}']")
            numbers = [fixed(value, 2) for value in (*residual["residual_mm"], residual["distance_mm"])]
            assert row.locator("td.number").all_inner_texts() == numbers
        expect(page.locator("[data-fit=scale]")).to_contain_text(fixed(fit["scale"], 4))
        assert abs(fit["scale"] - 1) < 0.02

        page.get_by_role("button", name="Save into the setup").click()
        expect(page.get_by_text("Saved as revision 2")).to_be_visible()
    stored = service.client.get(f"/v1/surgeries/{surgery}/spine").json()["setup"]["initial"]
    assert stored["kind"] == "radiographs"
    assert [item["vertebra"] for item in stored["vertebrae"]] == list(LEVELS)
    for item, truth in zip(stored["vertebrae"], pair.document["vertebrae"], strict=True):
        for view in ("pa", "lateral"):
            for name in ORDER[view]:
                assert item[view][name] == pytest.approx(truth[view][name], abs=8)


def test_a_landmark_is_placed_and_nudged_by_keys_and_undone(
    service: Service, visit: Visit, surgery: str, pair: Films
) -> None:
    uploaded(service, surgery, pair)
    with visit(service) as visitor:
        page = show(visitor, surgery)
        frame = film(page, "pa")
        visitor.tab_to(frame)
        expect(current(page)).to_have_text("T7: left end of the upper end plate")
        page.keyboard.press("Control+ArrowRight")
        page.keyboard.press("Enter")
        expect(current(page)).to_have_text("T7: right end of the upper end plate")
        page.keyboard.press("p")
        expect(page.get_by_label("u, px to the right")).to_have_value("1109.5")
        page.keyboard.press("ArrowLeft")
        page.keyboard.press("Shift+ArrowDown")
        expect(page.get_by_label("u, px to the right")).to_have_value("1109.4")
        expect(page.get_by_label("v, px down")).to_have_value("2000.5")
        page.keyboard.press("Control+z")
        expect(page.get_by_label("v, px down")).to_have_value("1999.5")
        page.keyboard.press("Control+Shift+z")
        expect(page.get_by_label("v, px down")).to_have_value("2000.5")
        page.reload()
        expect(
            page.get_by_role(
                "button", name="T7: left end of the upper end plate, PA view, at 1109.4, 2000.5 px"
            )
        ).to_be_visible()


def test_the_band_of_the_other_view_contains_the_landmark(
    service: Service, visit: Visit, surgery: str, pair: Films
) -> None:
    identifiers = uploaded(service, surgery, pair)
    document = {**pair.document, **identifiers, "landmark_sd_px": 1.0}
    url = f"/v1/surgeries/{surgery}/spine"
    stored = service.client.get(url)
    answer = service.client.put(
        url,
        json={**stored.json()["setup"], "initial": document},
        headers={"If-Match": stored.headers["ETag"]},
    )
    assert answer.status_code == 200, answer.text
    with visit(service) as visitor:
        page = show(visitor, surgery)
        page.get_by_role("button", name="common point screw 1, lateral view").click()
        expect(page.locator(".film-frame-active .band").first).to_be_attached()
        expect(page.locator(".now .badge-good")).to_have_text("0.0 px from the height of screw 1")
        page.get_by_label("v, px down").fill(str(pair.document["common"][0]["lateral"][1] + 30))
        page.get_by_role("button", name="Move there").click()
        expect(page.locator(".now .badge-warning")).to_contain_text("px from the height of screw 1")


def test_a_wrong_pixel_spacing_raises_the_scale_alarm(
    service: Service, visit: Visit, surgery: str, pair: Films
) -> None:
    identifiers = uploaded(service, surgery, pair)
    common = [
        {**point, "object_mm": [1.03 * value for value in point["object_mm"]]}
        for point in pair.document["common"]
    ]
    document = {**pair.document, **identifiers, "common": common}
    url = f"/v1/surgeries/{surgery}/spine"
    stored = service.client.get(url)
    service.client.put(
        url,
        json={**stored.json()["setup"], "initial": document},
        headers={"If-Match": stored.headers["ETag"]},
    )
    with visit(service) as visitor:
        page = show(visitor, surgery)
        expect(page.get_by_role("alert").filter(has_text="Scale alarm")).to_be_visible()
