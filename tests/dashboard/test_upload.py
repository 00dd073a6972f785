"""The sample surgery through the page: from a new surgery to its numbers."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from uuid import uuid4

from playwright.sync_api import FilePayload, Page, expect

from tests.dashboard.conftest import Visit
from tests.dashboard.numbers import fixed, interval, signed
from tests.dashboard.sample import STAGES, configure, spines_are_computed, summary
from tests.dashboard.visitor import Visitor
from tests.http.harness import SAMPLE, Service, pair, wait_for


def test_the_sample_surgery_is_measured_from_the_page(service: Service, visit: Visit) -> None:
    service.calibration()
    with visit(service) as visitor:
        surgery = add_surgery(visitor)
        configure(service, surgery)
        for name in STAGES:
            send(visitor, name)
            expect(visitor.stage(name).get_by_text("measured", exact=True)).to_be_visible()
        wait_for(lambda: spines_are_computed(service, surgery), "the spines")
        expect(visitor.page.get_by_role("heading", name="Now: POST")).to_be_visible()
        check_glance(visitor.page, summary(service, surgery))
        by_cart = service.surgery()
        service.finished(service.submit(by_cart, "PRE", pair("PRE"), service.calibration()))
        assert images(service, surgery) == images(service, by_cart)
        visitor.screenshot("surgery", full_page=True)


def test_files_are_dropped_paired_and_reassigned(service: Service, visit: Visit) -> None:
    service.calibration()
    with visit(service) as visitor:
        page = visitor.page
        add_surgery(visitor)
        drop(page, {"scan_R.png": SAMPLE / "PRE/right.png", "scan_L.png": SAMPLE / "PRE/left.png"})
        left, right = (page.get_by_label(f"{side} image of pair 1", exact=True) for side in ("Left", "Right"))
        expect(left.locator("option:checked")).to_have_text("scan_L.png")
        expect(right.locator("option:checked")).to_have_text("scan_R.png")
        expect(page.get_by_label("Name of the stage")).to_have_value("scan")
        page.get_by_role("button", name="Exchange left and right of pair 1").click()
        expect(left.locator("option:checked")).to_have_text("scan_R.png")
        left.select_option(label="scan_L.png")
        expect(right.locator("option:checked")).to_have_text("scan_R.png")
        drop(page, {"a.png": SAMPLE / "PRE/left.png", "b.png": SAMPLE / "PRE/right.png"})
        expect(page.get_by_text("do not say which is left")).to_be_visible()


def test_what_is_missing_is_said_before_anything_is_sent(service: Service, visit: Visit) -> None:
    with visit(service) as visitor:
        page = visitor.page
        surgery = add_surgery(visitor)
        page.get_by_role("button", name="Send the pair").click()
        expect(page.get_by_role("alert")).to_contain_text("Choose the two images")
        expect(page.get_by_role("alert")).to_contain_text("Name the stage")
        assert service.client.get(f"/v1/surgeries/{surgery}/stages").json()["total"] == 0


def test_what_the_service_refuses_is_shown_with_its_reason(service: Service, visit: Visit) -> None:
    service.calibration()
    with visit(service) as visitor:
        visitor.tolerated = ("422",)
        page = visitor.page
        add_surgery(visitor)
        same = (SAMPLE / "PRE/left.png").read_bytes()
        choose(page, [payload("left.png", same), payload("right.png", same)])
        page.get_by_label("Name of the stage").fill("PRE")
        page.get_by_role("button", name="Send the pair").click()
        expect(page.get_by_role("alert")).to_contain_text("left and right are the same image")
        page.get_by_role("button", name="Discard").click()
        expect(page.get_by_role("button", name="Send again")).to_have_count(0)


def test_a_stage_is_taken_again(service: Service, visit: Visit) -> None:
    calibration, surgery = service.calibration(), service.surgery()
    service.finished(service.submit(surgery, "PRE", pair("PRE"), calibration))
    with visit(service) as visitor:
        page = visitor.page
        visitor.surgery(surgery)
        page.get_by_role("button", name="Take again").click()
        expect(page.get_by_text("this is its next take")).to_be_visible()
        choose(page, [SAMPLE / "INTER" / f"{side}.png" for side in ("left", "right")])
        page.get_by_role("button", name="Send another take").click()
        expect(visitor.stage("PRE").get_by_text("2 takes")).to_be_visible()
        expect(page.get_by_role("table").filter(has_text="Takes and revisions")).to_contain_text("2 (counts)")


def images(service: Service, surgery: str) -> Any:
    """Return the description of the images of PRE, with their digests."""
    return service.client.get(f"/v1/surgeries/{surgery}/stages/PRE").json()["images"]


def add_surgery(visitor: Visitor) -> str:
    """Add a surgery by the form of the page, and return its identifier."""
    page = visitor.page
    page.get_by_role("button", name="New surgery").click()
    page.get_by_label("Case number").fill(f"case-{uuid4().int % 10**12}")
    page.get_by_label("Vertebrae with a marker").fill("L1 T11 T9 T7")
    expect(page.get_by_label("Vertebra of reference")).to_have_value("L1")
    page.get_by_label("Axis along the spine").select_option("x")
    page.get_by_role("button", name="Add the surgery").click()
    page.wait_for_url(re.compile("#/surgeries/"))
    expect(page.get_by_role("heading", name="Add a stage")).to_be_visible()
    return page.url.rsplit("/", 1)[1]


def send(visitor: Visitor, stage: str) -> None:
    """Send a stage of the sample by the form of the page."""
    page = visitor.page
    choose(page, [SAMPLE / stage / f"{side}.png" for side in ("right", "left")])
    expect(page.get_by_label("Left image of pair 1", exact=True).locator("option:checked")).to_have_text(
        "left.png"
    )
    page.get_by_label("Name of the stage").fill(stage)
    page.get_by_role("button", name="Send the pair").click()
    expect(visitor.stage(stage)).to_be_visible()


def choose(page: Page, files: list[Path] | list[FilePayload]) -> None:
    """Choose files in the file chooser of the form."""
    page.get_by_label("Images: a stereo pair").set_input_files(files)


def payload(name: str, content: bytes) -> FilePayload:
    return {"name": name, "mimeType": "image/png", "buffer": content}


def drop(page: Page, files: dict[str, Path]) -> None:
    """Drop files on the page."""
    contents = {name: list(path.read_bytes()) for name, path in files.items()}
    transfer = page.evaluate_handle(
        """contents => {
          const transfer = new DataTransfer();
          for (const [name, bytes] of Object.entries(contents))
            transfer.items.add(new File([new Uint8Array(bytes)], name, {type: 'image/png'}));
          return transfer;
        }""",
        contents,
    )
    page.dispatch_event("main", "dragover", {"dataTransfer": transfer})
    page.dispatch_event("main", "drop", {"dataTransfer": transfer})


def check_glance(page: Page, document: dict[str, Any]) -> None:
    """Check that the numbers of the glance panel are those of the API."""
    spine = document["stages"][-1]["spine"]
    panel = page.get_by_role("region", name="Now: POST")
    for definition, title in (("cobb-fixed", "Cobb"), ("apical-rotation", "rotation")):
        now = next(value for value in spine["measures"] if value["definition"] == definition)
        change = next(v for v in spine["since_baseline"]["measures"] if v["definition"] == definition)
        values = panel.locator(".glance-value").filter(has_text=re.compile(title, re.IGNORECASE))
        expect(values.nth(0)).to_contain_text(f"{fixed(now['value'])}°")
        expect(values.nth(0)).to_contain_text(interval(now["interval"], "°"))
        expect(values.nth(1)).to_contain_text(f"{signed(change['value'])}°")
        expect(values.nth(1)).to_contain_text(interval(change["interval"], "°"))
