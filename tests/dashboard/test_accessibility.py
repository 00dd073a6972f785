"""No page has a serious finding of axe-core, in either theme."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.dashboard.conftest import Visit
from tests.dashboard.pages import PAGES, show
from tests.dashboard.web import NotAvailableError, packages
from tests.http.harness import Service

_RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]
_SERIOUS = {"serious", "critical"}


@pytest.fixture(scope="session")
def axe() -> str:
    """The script of axe-core, which is evaluated outside the policy of the page."""
    try:
        return (packages() / "axe-core" / "axe.min.js").read_text()
    except NotAvailableError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("name", PAGES)
def test_a_page_has_no_serious_finding(
    service: Service, visit: Visit, measured: str, calibration: str, axe: str, name: str, theme: str
) -> None:
    with visit(service, theme=theme) as visitor:
        show(visitor, name, measured, calibration)
        visitor.screenshot(f"{name}-{theme}", full_page=True)
        assert findings(visitor.page, axe) == []


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_sign_in_has_no_serious_finding(service: Service, visit: Visit, axe: str, theme: str) -> None:
    with visit(service, theme=theme, signed_in=False) as visitor:
        visitor.screenshot(f"sign-in-{theme}")
        assert findings(visitor.page, axe) == []


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_forms_and_failures_have_no_serious_finding(
    service: Service, visit: Visit, axe: str, theme: str
) -> None:
    with visit(service, theme=theme) as visitor:
        visitor.tolerated = ("404",)
        visitor.page.get_by_role("button", name="New surgery").click()
        expect(visitor.page.get_by_label("Case number")).to_be_visible()
        assert findings(visitor.page, axe) == []
        visitor.open("/surgeries/00000000-0000-0000-0000-000000000000")
        expect(visitor.page.get_by_role("alert")).to_contain_text("no such surgery")
        assert findings(visitor.page, axe) == []


def findings(page: Page, axe: str) -> list[str]:
    """Return the serious findings, each with the elements that it is about."""
    page.evaluate(axe)
    found: list[dict[str, Any]] = page.evaluate(
        "async (tags) => (await axe.run({runOnly: {type: 'tag', values: tags}})).violations", _RULES
    )
    return [
        f"{finding['id']}: {node['html'][:200]} {node['failureSummary'][:300]}"
        for finding in found
        if finding["impact"] in _SERIOUS
        for node in finding["nodes"]
    ]
