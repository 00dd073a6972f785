"""Every page, and when it is complete."""

from __future__ import annotations

import re
from collections.abc import Mapping

from playwright.sync_api import expect

from tests.dashboard.visitor import Visitor

PAGES: Mapping[str, tuple[str, str | re.Pattern[str]]] = {
    "surgeries": ("/", "Surgeries"),
    "surgery": ("/surgeries/{surgery}", re.compile(r"^case-\d+$")),
    "stage": ("/surgeries/{surgery}/stages/INTER", re.compile(r"^case-\d+$")),
    "images": ("/surgeries/{surgery}/stages/POST/images", re.compile("POST")),
    "radiographs": ("/surgeries/{surgery}/radiographs", re.compile("Radiographs")),
    "setup": ("/surgeries/{surgery}/setup", re.compile("Setup")),
    "calibrations": ("/calibrations", "Calibrations"),
    "calibration": ("/calibrations/{calibration}", re.compile("cart 1")),
    "planner": ("/planner", re.compile("[Pp]lan")),
    "unknown": ("/nothing", "No such page"),
}
"""The route of each page, and its heading."""


def show(visitor: Visitor, name: str, surgery: str, calibration: str) -> None:
    """Show a page, and wait until all of it is there."""
    route, heading = PAGES[name]
    visitor.open(route.format(surgery=surgery, calibration=calibration))
    expect(visitor.page.get_by_role("heading", level=1, name=heading)).to_be_visible()
    expect(visitor.page.locator(".loading")).to_have_count(0)
