"""A new stage appears by itself: at once, after a lost network, and after the service was started again."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import expect

from tests.dashboard.conftest import Visit
from tests.dashboard.sample import configure
from tests.dashboard.visitor import Visitor
from tests.http.harness import Service, pair, wait_for
from tests.patience import PATIENCE_S

_WATCH = """
  window.appeared = {};
  const look = () => {
    for (const link of document.querySelectorAll('nav[aria-label="Stages"] a'))
      if (link.textContent.includes('measured'))
        window.appeared[link.querySelector('strong').textContent] ??= Date.now() / 1000;
  };
  new MutationObserver(look).observe(document.body, {subtree: true, childList: true, characterData: true});
  look();
"""


class Follower:
    """Another client of the same stream: when it heard that each stage was measured, seconds since the epoch."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._open = threading.Event()
        self.heard: dict[str, float] = {}

    def follow(self, stop: threading.Event) -> None:
        with (
            httpx.Client(
                base_url=self._service.client.base_url,
                headers=self._service.client.headers,
                trust_env=False,
                timeout=PATIENCE_S,
            ) as client,
            client.stream("GET", "/v1/events") as answer,
        ):
            for line in answer.iter_lines():
                self._open.set()
                if stop.is_set():
                    return
                if line.startswith("data:"):
                    change = json.loads(line.removeprefix("data:"))
                    if change["action"] == "stage:measured":
                        self.heard[change["stage"]] = time.time()

    def is_open(self) -> bool:
        return self._open.is_set()


@contextmanager
def following(service: Service) -> Iterator[Follower]:
    """Follow the stream of the service in a thread."""
    follower, stop = Follower(service), threading.Event()
    thread = threading.Thread(target=follower.follow, args=(stop,))
    thread.start()
    try:
        wait_for(follower.is_open, "the stream")
        yield follower
    finally:
        stop.set()
        service.surgery()  # whose event ends the wait for the next line
        thread.join()


@pytest.fixture
def own_service(tmp_path: Path) -> Iterator[Service]:
    """A service that a test may stop."""
    with Service(tmp_path) as service:
        service.start("worker")
        yield service


def test_a_new_stage_appears_within_a_second(service: Service, visit: Visit) -> None:
    surgery, calibration = service.surgery(), service.calibration()
    configure(service, surgery)
    with following(service) as follower, visit(service) as visitor:
        visitor.open(f"/surgeries/{surgery}")
        expect(visitor.page.get_by_text("No stages yet.")).to_be_visible()
        visitor.page.evaluate(_WATCH)
        delays = []
        for name in ("PRE", "INTER", "POST"):
            service.finished(service.submit(surgery, name, pair(name), calibration))
            shown = visitor.page.wait_for_function("name => window.appeared[name]", arg=name).json_value()
            delays.append(shown - wait_for(partial(follower.heard.get, name), name))
        assert min(delays) < 1.0, delays  # the least of three: the machine may be busy
        expect(visitor.page.get_by_role("heading", name="Now: POST")).to_be_visible()


def test_a_stage_of_a_time_without_network_appears_when_it_is_back(service: Service, visit: Visit) -> None:
    surgery, calibration = service.surgery(), service.calibration()
    service.finished(service.submit(surgery, "PRE", pair("PRE"), calibration))
    with visit(service) as visitor:
        visitor.surgery(surgery)
        loaded_once(visitor)
        visitor.page.context.set_offline(True)
        expect(visitor.page.get_by_text("No connection to the service")).to_be_visible()
        expect(visitor.page.get_by_role("heading", name="not up to date")).to_be_visible()
        visitor.screenshot("connection-lost")
        service.finished(service.submit(surgery, "INTER", pair("INTER"), calibration))
        assert visitor.stage("INTER").count() == 0
        visitor.page.context.set_offline(False)
        expect(visitor.stage("INTER").get_by_text("measured", exact=True)).to_be_visible()
        expect(visitor.page.get_by_text("No connection to the service")).to_have_count(0)
        expect(visitor.page.get_by_text("Part of the page not loaded")).to_have_count(0)
        assert_never_loaded_again(visitor)


def test_the_page_goes_on_after_the_service_was_started_again(own_service: Service, visit: Visit) -> None:
    service = own_service
    surgery, calibration = service.surgery(), service.calibration()
    service.finished(service.submit(surgery, "PRE", pair("PRE"), calibration))
    with visit(service) as visitor:
        visitor.tolerated = ("net::ERR_CONNECTION_RESET",)  # a request that the ending server did not take
        visitor.surgery(surgery)
        loaded_once(visitor)
        service.server.terminate()
        service.server.wait()
        expect(visitor.page.get_by_text("No connection to the service")).to_be_visible()
        service.start("serve")
        wait_for(service.ready, "the service")
        service.finished(service.submit(surgery, "INTER", pair("INTER"), calibration))
        expect(visitor.stage("INTER").get_by_text("measured", exact=True)).to_be_visible()
        expect(visitor.page.get_by_text("Live", exact=True)).to_be_visible()
        assert_never_loaded_again(visitor)


def test_without_a_stream_the_page_asks(service: Service, visit: Visit) -> None:
    surgery, calibration = service.surgery(), service.calibration()
    with visit(service, signed_in=False) as visitor:
        visitor.tolerated = ("ERR_FAILED",)
        visitor.page.context.route("**/v1/events*", lambda route: route.abort())
        visitor.page.get_by_label("API key").fill(service.key)
        visitor.page.get_by_role("button", name="Sign in").click()
        expect(visitor.page.get_by_role("button", name="Sign out")).to_be_visible()
        visitor.open(f"/surgeries/{surgery}")
        expect(visitor.page.get_by_text("No stages yet.")).to_be_visible()
        service.finished(service.submit(surgery, "PRE", pair("PRE"), calibration))
        expect(visitor.stage("PRE").get_by_text("measured", exact=True)).to_be_visible()
        expect(visitor.page.get_by_text("Live", exact=True)).to_be_visible()


def test_a_running_measurement_shows_its_progress(tmp_path: Path, visit: Visit) -> None:
    with Service(tmp_path) as service:
        surgery, calibration = service.surgery(), service.calibration()
        with visit(service) as visitor:
            visitor.open(f"/surgeries/{surgery}")
            service.submit(surgery, "PRE", pair("PRE"), calibration)
            expect(visitor.stage("PRE")).to_contain_text("waiting for a worker")
            expect(visitor.page.get_by_text("PRE waits to be measured.")).to_be_visible()
            visitor.page.get_by_role("button", name="Cancel the measurement").click()
            expect(visitor.stage("PRE")).to_contain_text("cancelled")


def loaded_once(visitor: Visitor) -> None:
    """Leave a mark that a page loaded again would not have."""
    visitor.page.evaluate("window.mark = true")


def assert_never_loaded_again(visitor: Visitor) -> None:
    assert visitor.page.evaluate("window.mark === true")
