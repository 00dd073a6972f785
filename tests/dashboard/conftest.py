from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import Protocol

import pytest
from playwright.sync_api import Browser

from tests.dashboard.browser import NoBrowserError, launched
from tests.dashboard.sample import measured_surgery
from tests.dashboard.visitor import Visitor, visiting
from tests.http.harness import Service, board


class Visit(Protocol):
    """Opens the page of a service in a window of its own; the end of the context checks what the page did."""

    def __call__(
        self, service: Service, *, theme: str = "dark", signed_in: bool = True
    ) -> AbstractContextManager[Visitor]: ...


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A browser. As long as it runs, so does an event loop in this thread: other tests could not run theirs."""
    try:
        with launched() as browser:
            yield browser
    except NoBrowserError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service with a worker, whose site allows every case number."""
    with Service(tmp_path_factory.mktemp("dashboard"), SPINEWATCH_REFERENCE_PATTERN=".+") as service:
        service.start("worker")
        yield service


@pytest.fixture(scope="session")
def measured(service: Service) -> str:
    """A surgery with a setup of the spine whose stages PRE, INTER and POST are measured."""
    return measured_surgery(service)


@pytest.fixture(scope="session")
def calibration(service: Service) -> str:
    """A calibration from images, with its report."""
    job = service.calibrated(board("C"), board("A"), verify="1")
    assert job["state"] == "succeeded", job
    return str(job["calibration_id"])


@pytest.fixture
def visit(browser: Browser) -> Visit:
    def opened(
        service: Service, *, theme: str = "dark", signed_in: bool = True
    ) -> AbstractContextManager[Visitor]:
        return visiting(browser, service, theme=theme, signed_in=signed_in)

    return opened
