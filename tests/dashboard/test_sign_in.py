"""Signing in: by typing a key, and by the address that the command line prints."""

import re

from playwright.sync_api import expect

from contract.key import Scope
from tests.dashboard.conftest import Visit
from tests.http.harness import Service

WRONG = "sw_aaaaaaaa_" + "a" * 52


def test_the_key_in_the_address_signs_in_and_disappears(service: Service, visit: Visit) -> None:
    with visit(service) as visitor:
        assert service.key not in visitor.page.url
        expect(visitor.page.get_by_role("heading", name="Surgeries", exact=True)).to_be_visible()
        assert visitor.page.evaluate("document.cookie") == ""
        kept = visitor.page.evaluate("JSON.stringify([{...localStorage}, {...sessionStorage}])")
        assert service.key not in kept
        visitor.page.go_back()
        assert service.key not in visitor.page.url


def test_a_typed_key_signs_in_and_out(service: Service, visit: Visit) -> None:
    with visit(service, signed_in=False) as visitor:
        page = visitor.page
        expect(page.get_by_role("heading", name="Spinewatch")).to_be_visible()
        page.get_by_label("API key").fill(service.key)
        page.get_by_role("button", name="Sign in").click()
        expect(page.get_by_role("heading", name="Surgeries", exact=True)).to_be_visible()
        page.reload()
        expect(page.get_by_role("heading", name="Surgeries", exact=True)).to_be_visible()
        page.get_by_role("button", name="Sign out").click()
        expect(page.get_by_label("API key")).to_be_visible()
        page.reload()
        expect(page.get_by_label("API key")).to_have_value("")


def test_a_wrong_key_is_refused_in_words(service: Service, visit: Visit) -> None:
    with visit(service, signed_in=False) as visitor:
        visitor.tolerated = ("401",)
        visitor.page.get_by_label("API key").fill(WRONG)
        visitor.page.get_by_label("API key").press("Enter")
        expect(visitor.page.get_by_role("alert")).to_contain_text("unknown, revoked or expired")


def test_nobody_is_asked_for_what_they_have_no_session_for(service: Service, visit: Visit) -> None:
    refused = len(service.sql("SELECT seq FROM events WHERE action = 'request:refused'"))
    with visit(service, signed_in=False):
        pass
    assert len(service.sql("SELECT seq FROM events WHERE action = 'request:refused'")) == refused


def test_a_session_that_has_ended_asks_for_the_key(service: Service, visit: Visit) -> None:
    with visit(service) as visitor:
        visitor.tolerated = ("401",)
        visitor.page.context.clear_cookies()
        visitor.page.evaluate("dispatchEvent(new Event('online'))")
        expect(visitor.page.get_by_label("API key")).to_be_visible()


def test_a_key_that_only_reads_is_offered_no_changes(service: Service, visit: Visit, measured: str) -> None:
    key = service.make_key(Scope.STAGE_READ)
    with visit(service, signed_in=False) as visitor:
        page = visitor.page
        page.get_by_label("API key").fill(key)
        page.get_by_role("button", name="Sign in").click()
        expect(page.get_by_role("heading", name="Surgeries", exact=True)).to_be_visible()
        expect(page.get_by_role("button", name="New surgery")).to_have_count(0)
        visitor.surgery(measured)
        expect(page.get_by_role("heading", name=re.compile("^Now: POST"))).to_be_visible()
        expect(page.get_by_role("heading", name="Add a stage")).to_have_count(0)
