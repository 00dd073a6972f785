"""Everything by keyboard: signing in, a new surgery, its first stage, and its pages."""

from __future__ import annotations

from playwright.sync_api import expect

from tests.dashboard.conftest import Visit
from tests.http.harness import SAMPLE, Service


def test_a_surgery_from_sign_in_to_its_first_stage(service: Service, visit: Visit) -> None:
    service.calibration()
    with visit(service, signed_in=False) as visitor:
        page, keyboard = visitor.page, visitor.page.keyboard
        keyboard.type(service.key)
        keyboard.press("Enter")
        visitor.tab_to(page.get_by_role("button", name="New surgery"))
        keyboard.press("Enter")
        expect(page.get_by_label("Case number")).to_be_focused()
        keyboard.type("case-1741")
        keyboard.press("Tab")
        keyboard.type("L1 T11 T9 T7")
        visitor.tab_to(page.get_by_label("Axis along the spine"))
        keyboard.press("ArrowDown")
        expect(page.get_by_label("Axis along the spine")).to_have_value("x")
        visitor.tab_to(page.get_by_role("button", name="Add the surgery"))
        keyboard.press("Enter")
        expect(page.get_by_role("heading", level=1, name="case-1741")).to_be_focused()
        visitor.tab_to(page.get_by_label("Images: a stereo pair"))
        with page.expect_file_chooser() as chooser:
            keyboard.press("Space")
        chooser.value.set_files([SAMPLE / "PRE" / f"{side}.png" for side in ("left", "right")])
        visitor.tab_to(page.get_by_role("button", name="Exchange left and right of pair 1"))
        keyboard.press("Enter")
        keyboard.press("Space")
        expect(page.get_by_label("Left image of pair 1", exact=True).locator("option:checked")).to_have_text(
            "left.png"
        )
        visitor.tab_to(page.get_by_label("Name of the stage"))
        keyboard.type("PRE")
        visitor.tab_to(page.get_by_role("button", name="Send the pair"))
        keyboard.press("Enter")
        expect(page.get_by_label("Images: a stereo pair")).to_be_focused()
        expect(visitor.stage("PRE").get_by_text("measured", exact=True)).to_be_visible()
        visitor.tab_to(visitor.stage("PRE"))
        keyboard.press("Enter")
        expect(visitor.stage("PRE")).to_have_attribute("aria-current", "true")


def test_the_first_tab_leads_over_the_navigation(service: Service, visit: Visit, measured: str) -> None:
    with visit(service) as visitor:
        visitor.surgery(measured)
        visitor.page.reload()
        expect(visitor.page.get_by_role("heading", level=1)).to_be_visible()
        visitor.tab_to(visitor.page.get_by_role("link", name="Skip to content"), most=1)
        visitor.page.keyboard.press("Enter")
        expect(visitor.page.get_by_role("heading", level=1)).to_be_focused()


def test_the_themes_are_switched_and_remembered(service: Service, visit: Visit) -> None:
    with visit(service) as visitor:
        page = visitor.page
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
        visitor.tab_to(page.get_by_role("button", name="Light theme"))
        page.keyboard.press("Enter")
        assert page.evaluate("document.documentElement.dataset.theme") == "light"
        page.reload()
        expect(page.get_by_role("button", name="Dark theme")).to_be_visible()
        assert page.evaluate("document.documentElement.dataset.theme") == "light"


def test_every_page_of_a_surgery_is_reached_by_tab(service: Service, visit: Visit, measured: str) -> None:
    with visit(service) as visitor:
        visitor.surgery(measured)
        for name in ("Setup of the spine", "Radiographs"):
            visitor.surgery(measured)
            expect(visitor.page.get_by_role("heading", level=1)).to_be_focused()
            visitor.tab_to(visitor.page.get_by_role("link", name=name))
            visitor.page.keyboard.press("Enter")
            expect(visitor.page.get_by_role("heading", level=1)).to_be_focused()
