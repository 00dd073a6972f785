"""The images of a stage: what is drawn over them, epipolar lines, candidates, and corrections by hand."""

from __future__ import annotations

import base64
import json
import re
from io import BytesIO
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator, Route, expect

from spinewatch.detection.features import Features
from spinewatch.geometry.rays import nearest_points
from spinewatch.imaging.decoding import decode_image
from spinewatch.matching.epipolar import (
    EpipolarParameters,
    candidate_pairs,
    epipolar_distance_sigma,
    range_limits_mm,
)
from spinewatch.rig_files.rig_json import rig_from_dict
from tests.dashboard.conftest import Visit
from tests.dashboard.test_accessibility import findings
from tests.dashboard.visitor import Visitor
from tests.dashboard.web import WEB, NotAvailableError, packages
from tests.http.harness import SAMPLE, VERTEBRAE, Service, pair

SIDES = ("left", "right")
FIXTURES = WEB / "test" / "images"
HOSTILE = "<img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def surgery(service: Service) -> str:
    """A surgery whose stage PRE is measured, and is not corrected."""
    return measured_pre(service)


def test_the_numbers_that_the_page_is_tested_with_are_those_of_the_library() -> None:
    given = json.loads((FIXTURES / "rig.json").read_text())
    rig = rig_from_dict(given["rig"])
    points = np.array(given["points_mm"])
    assert np.allclose(rig.left.project(points), given["left_px"], rtol=0, atol=1e-9)
    assert np.allclose(rig.right.project(points), given["right_px"], rtol=0, atol=1e-9)
    covariance = np.array(given["centres"]["covariance_px2"])
    left, right = (
        Features(np.array(given["centres"][side]), np.ones(len(points)), np.tile(covariance, (len(points), 1, 1)))
        .rays(getattr(rig, side), 0.33)
        for side in SIDES
    )  # fmt: skip
    parameters = EpipolarParameters()
    found = candidate_pairs(left, right, rig, parameters)
    assert np.column_stack([found.left, found.right]).tolist() == given["pairs"]
    assert np.allclose(range_limits_mm(rig, parameters), given["range_limits_mm"])
    assert np.allclose(epipolar_distance_sigma(left, right), given["distance_sigma"])
    positions, parallaxes = nearest_points([left, right])
    assert np.allclose(positions, given["positions_mm"])
    assert np.allclose(parallaxes, given["parallax_mm"])


def test_the_pictures_that_the_page_is_tested_with_are_read_so_by_the_library() -> None:
    for example in json.loads((FIXTURES / "samples.json").read_text()):
        levels = decode_image(base64.b64decode(example["file"]))
        kind = "<u2" if example["bits"] == 16 else "u1"
        wanted = np.frombuffer(base64.b64decode(example["levels"]), kind).reshape(levels.shape)
        assert np.array_equal(levels, wanted), example["name"]


def test_every_ball_of_the_api_is_drawn(service: Service, visit: Visit, surgery: str) -> None:
    triads = document(service, surgery, "triads")["triads"]
    with visit(service) as visitor:
        show(visitor, surgery)
        for side in SIDES:
            assert viewer(visitor, side).locator(".mark.ball").count() == len(centres(triads, side))
            labels = viewer(visitor, side).locator(".triad-label").all_text_contents()
            assert labels == [triad["label"] for triad in triads]
        rows = visitor.page.get_by_role("table").locator("tbody tr")
        assert rows.count() == sum(len(triad["balls"]) for triad in triads)
        expect(rows.first).to_contain_text(f"{triads[0]['balls']['XX']['left'][0]:.2f}")
        visitor.page.get_by_label("Other features").check()
        features = document(service, surgery, "features")["features"]
        for side in SIDES:
            expect(viewer(visitor, side).locator(".mark")).to_have_count(len(features[side]))


@pytest.mark.parametrize("side", SIDES)
def test_epipolar_lines_pass_through_the_matched_balls(
    service: Service, visit: Visit, surgery: str, side: str
) -> None:
    triads = document(service, surgery, "triads")["triads"]
    other = SIDES[1 - SIDES.index(side)]
    with visit(service) as visitor:
        show(visitor, surgery)
        viewer(visitor, side).focus()
        for triad in triads:
            for name, ball in triad["balls"].items():
                visitor.page.keyboard.press("n")
                focused = viewer(visitor, side).locator(".mark:focus")
                expect(focused).to_have_attribute(
                    "aria-label", re.compile(f"^{triad['label']} {name}, {side} image")
                )
                line = viewer(visitor, other).locator(".epipolar-line").get_attribute("data-line")
                assert line is not None
                assert distance(line, ball[other]) < 1
                candidates = (
                    viewer(visitor, other)
                    .locator(".mark.is-candidate")
                    .evaluate_all("marks => marks.map(mark => mark.getAttribute('aria-label'))")
                )
                assert any(found.startswith(f"{triad['label']} {name},") for found in candidates)
        expect(viewer(visitor, side).locator(".epipolar-line")).to_have_count(0)


def test_rejected_candidates_are_listed_with_their_reasons(
    service: Service, visit: Visit, surgery: str
) -> None:
    triads = document(service, surgery, "candidates")["explanation"]["triads"]
    rejected = [triad for triad in triads if triad["reason"] is not None]
    with visit(service) as visitor:
        page = visitor.page
        show(visitor, surgery)
        page.get_by_role("tab", name="Candidate triads").click()
        table = page.get_by_role("table")
        expect(table).to_contain_text(f"{len(rejected)} candidate triads")
        name = f"Candidate {triads.index(rejected[0]) + 1}"
        page.get_by_role("button", name=name, exact=True).focus()
        for side in SIDES:
            expect(viewer(visitor, side).locator(".triplet")).to_be_visible()
        for reason in sorted({triad["reason"] for triad in rejected}):
            page.get_by_label("Which candidate triads").select_option(reason)
            same = [triad for triad in rejected if triad["reason"] == reason]
            expect(table).to_contain_text(f"{len(same)} candidate triads")
            heuristic = same[0]["heuristic"] or "none"
            expect(table.locator("tbody tr").first.locator("td").nth(1)).to_have_text(heuristic)


def test_a_ball_and_a_label_are_corrected_by_keyboard(service: Service, visit: Visit) -> None:
    surgery = measured_pre(service)
    before = document(service, surgery, "triads")["triads"]
    with visit(service) as visitor:
        page = visitor.page
        show(visitor, surgery)
        visitor.tab_to(page.get_by_role("button", name="Correct by hand"))
        page.keyboard.press("Enter")
        visitor.tab_to(viewer(visitor, "left"))
        for key in ["n", "b", *["ArrowRight"] * 5, "Shift+ArrowDown", "Control+z", *["ArrowRight"] * 4]:
            page.keyboard.press(key)
        expect(changes(visitor)).to_have_text(
            [f"Move ball centre {before[0]['label']} XX, left image, by 0.4 px"]
        )
        page.keyboard.press("p")
        page.keyboard.press("Enter")
        visitor.tab_to(page.get_by_label("Label of the triad"))
        page.keyboard.press("Home")
        expect(changes(visitor).first).to_have_text(f"Take away label {before[-1]['label']}")
        visitor.screenshot("images-correction", full_page=True)
        visitor.tab_to(page.get_by_role("button", name="Save as take 2"))
        page.keyboard.press("Enter")
        expect(viewer(visitor, "left")).to_have_attribute("data-take", "2")
        expect(viewer(visitor, "left").locator(".mark.ball .manual")).to_have_count(1)
        page.get_by_role("tab", name="Takes (2)").click()
        row = page.get_by_role("row").filter(has_text="correction of take 1")
        expect(row).to_contain_text("1 label, 1 ball centre")
        expect(row).to_contain_text("test")
        page.get_by_role("button", name="Compare with take 1").click()
        expect(page.get_by_role("table").nth(1)).to_contain_text("0.40")
    after = document(service, surgery, "triads")["triads"]
    moved, was = after[0]["balls"]["XX"], before[0]["balls"]["XX"]
    assert moved["manual"] == ["left"]
    assert moved["left"] == pytest.approx([was["left"][0] + 0.4, was["left"][1]], abs=0.006)
    unlabelled = [triad for triad in after if triad["label"] is None]
    assert [triad["label_manual"] for triad in unlabelled] == [True]


def test_centres_are_added_dragged_and_removed_with_the_mouse(
    service: Service, visit: Visit, surgery: str
) -> None:
    with visit(service) as visitor:
        page = visitor.page
        show(visitor, surgery)
        page.get_by_role("button", name="Correct by hand").click()
        right = viewer(visitor, "right")
        page.get_by_role("button", name="Add a ball centre").click()
        right.click(position={"x": 40, "y": 60})
        expect(changes(visitor)).to_have_text(["Add a ball centre, right image"])
        ball = right.locator(".mark.ball").first
        box = ball.locator(".hit").bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 30, y, steps=5)
        page.mouse.up()
        expect(changes(visitor)).to_have_count(2)
        expect(changes(visitor).first).to_contain_text("Move ball centre")
        page.get_by_role("button", name="Remove this ball centre").click()
        expect(changes(visitor).first).to_contain_text("Remove ball centre")
        for _ in range(3):
            page.get_by_role("button", name="Undo").click()
        expect(changes(visitor)).to_have_count(0)
        page.get_by_role("button", name="Stop correcting").click()


def test_a_correction_of_somebody_else_meanwhile_is_carried_over(service: Service, visit: Visit) -> None:
    surgery = measured_pre(service)
    with visit(service) as visitor:
        page = visitor.page
        show(visitor, surgery)
        page.get_by_role("button", name="Correct by hand").click()
        viewer(visitor, "right").locator(".mark.ball").first.focus()
        page.keyboard.press("Shift+ArrowLeft")
        expect(changes(visitor)).to_have_count(1)
        revise(service, surgery, {"kind": "edit", "take": 1, "labels": [{"triad": 1, "label": "T11"}]})
        notice = page.get_by_role("alert").filter(has_text="Take 2 was made meanwhile")
        expect(notice).to_be_visible()
        expect(page.get_by_role("button", name="Save as take 3")).to_be_disabled()
        notice.get_by_role("button", name="Carry over to take 2").click()
        expect(viewer(visitor, "left")).to_have_attribute("data-take", "2")
        expect(changes(visitor)).to_have_text(["Move ball centre L1 XX, right image, by 1.0 px"])
        page.get_by_role("button", name="Save as take 3").click()
        expect(viewer(visitor, "left")).to_have_attribute("data-take", "3")
    assert document(service, surgery, "triads")["triads"][0]["balls"]["XX"]["manual"] == ["right"]
    assert document(service, surgery, "triads")["triads"][1]["label_manual"]


def test_a_hostile_label_and_case_number_are_text(service: Service, visit: Visit) -> None:
    surgery = measured_pre(service, HOSTILE)
    with visit(service) as visitor:
        page = visitor.page
        page.route("**/stages/PRE/triads?*", with_hostile_label)
        show(visitor, surgery)
        expect(page.get_by_role("link", name=HOSTILE)).to_be_visible()
        expect(viewer(visitor, "left").locator(".triad-label").first).to_have_text(HOSTILE)
        expect(page.get_by_role("rowheader", name=HOSTILE)).to_be_visible()
        page.get_by_role("button", name="Correct by hand").click()
        viewer(visitor, "left").locator(".mark.ball").first.focus()
        page.get_by_role("button", name="Remove triad").click()
        expect(changes(visitor)).to_have_text([f"Remove triad {HOSTILE}"])


def test_images_of_16_bits_and_tiffs_are_shown(service: Service, visit: Visit) -> None:
    surgery = service.surgery()
    job = service.submit(surgery, "PRE", (deep("left", "TIFF"), deep("right", "PNG")), service.calibration())
    assert service.finished(job)["state"] == "succeeded"
    with visit(service) as visitor:
        show(visitor, surgery)
        for side in SIDES:
            expect(viewer(visitor, side).locator("xpath=..")).to_contain_text("16 bits")
            levels = (
                viewer(visitor, side)
                .locator("canvas")
                .evaluate(
                    "canvas => [...canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data]"
                    ".filter((_, k) => k % 4 === 0)"
                )
            )
            assert np.std(levels) > 40
            assert len(set(levels)) > 150


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_a_correction_has_no_serious_finding(
    service: Service, visit: Visit, surgery: str, theme: str
) -> None:
    try:
        axe = (packages() / "axe-core" / "axe.min.js").read_text()
    except NotAvailableError as error:
        pytest.skip(str(error))
    with visit(service, theme=theme) as visitor:
        page = visitor.page
        show(visitor, surgery)
        page.get_by_role("button", name="Correct by hand").click()
        viewer(visitor, "left").locator(".mark.ball").first.focus()
        page.keyboard.press("ArrowLeft")
        for tab in ("Balls", "Candidate triads", "Features", "Takes"):
            page.get_by_role("tab", name=tab).click()
            assert findings(page, axe) == []
        visitor.screenshot(f"images-{theme}", full_page=True)


def measured_pre(service: Service, reference: str | None = None) -> str:
    """Measure the stage PRE of the sample in a new surgery, which may have a case number."""
    surgery = service.surgery() if reference is None else named_surgery(service, reference)
    job = service.submit(surgery, "PRE", pair("PRE"), service.calibration())
    assert service.finished(job)["state"] == "succeeded"
    return surgery


def with_hostile_label(route: Route) -> None:
    """Answer with a label that no service of this version sends, and its database would not take."""
    answer = route.fetch()
    triads = answer.json()
    triads["triads"][0]["label"] = HOSTILE
    route.fulfill(response=answer, json=triads)


def named_surgery(service: Service, reference: str) -> str:
    """Add a surgery with a case number."""
    body = {"reference": reference, "vertebrae": VERTEBRAE, "reference_vertebra": "L1", "spine_axis": "x"}
    answer = service.client.post("/v1/surgeries", json=body)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


def document(service: Service, surgery: str, part: str) -> dict[str, Any]:
    """Return a document of the stage PRE."""
    answer = service.client.get(f"/v1/surgeries/{surgery}/stages/PRE/{part}")
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def revise(service: Service, surgery: str, changes: dict[str, Any]) -> None:
    """Make a revision over HTTP, and wait until it is measured."""
    answer = service.client.post(f"/v1/surgeries/{surgery}/stages/PRE/revisions", json=changes)
    assert answer.status_code == 202, answer.text
    assert service.finished(answer.json()["job"]["id"])["state"] == "succeeded"


def show(visitor: Visitor, surgery: str) -> None:
    """Show the images of the stage PRE, and wait until they are there."""
    visitor.open(f"/surgeries/{surgery}/stages/PRE/images")
    expect(viewer(visitor, "right").locator(".mark.ball").first).to_be_visible()
    expect(visitor.page.locator(".viewer-message")).to_have_count(0)


def viewer(visitor: Visitor, side: str) -> Locator:
    """Return the view of an image."""
    return visitor.page.get_by_role("group", name=f"{side.capitalize()} image", exact=True)


def changes(visitor: Visitor) -> Locator:
    """Return the sentences of what a correction changes."""
    return visitor.page.get_by_role("list", name="Changes of this correction").locator(".change-text")


def centres(triads: list[dict[str, Any]], side: str) -> list[list[float]]:
    """Return the ball centres of an image."""
    return [ball[side] for triad in triads for ball in triad["balls"].values() if ball[side] is not None]


def distance(line: str, point: list[float]) -> float:
    """Return the distance of a point from a line of points, px."""
    places = [np.array([float(value) for value in place.split(",")]) for place in line.split()]
    nearest = np.inf
    for start, end in pairwise(places):
        along = end - start
        share = np.clip((np.array(point) - start) @ along / (along @ along), 0, 1)
        nearest = min(nearest, float(np.linalg.norm(start + share * along - point)))
    return nearest


def deep(side: str, kind: str) -> bytes:
    """Return an image of the sample with 16 bits, of which 12 are used."""
    levels = np.asarray(Image.open(SAMPLE / "PRE" / f"{side}.png")).astype(np.uint16) * 16
    buffer = BytesIO()
    Image.fromarray(levels).save(buffer, kind)
    return buffer.getvalue()
