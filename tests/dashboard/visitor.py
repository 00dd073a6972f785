"""Somebody who looks at the page: what is done in a window, and what must never happen there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, Request, Route, expect

from tests.http.harness import Service
from tests.paths import PROJECT
from tests.patience import PATIENCE_S

SCREENSHOTS = PROJECT / "build" / "screenshots"
_PATIENCE_MS = PATIENCE_S * 500
_SIZE = (1920, 1080)
# what a browser reports while a test keeps the service from answering
_EXPECTED = (
    "net::ERR_INTERNET_DISCONNECTED",
    "net::ERR_CONNECTION_REFUSED",
    "net::ERR_INCOMPLETE_CHUNKED_ENCODING",
)
_WATCH = """
  window.violations = [];
  document.addEventListener('securitypolicyviolation', (event) => {
    window.violations.push(`${event.violatedDirective}: ${event.blockedURI}`);
  });
"""
_THEME = """
  if (location.protocol === 'http:' && localStorage.getItem('spinewatch-theme') === null)
    localStorage.setItem('spinewatch-theme', 'THEME');
"""


class Visitor:
    """A window with the page of a service."""

    def __init__(self, page: Page, service: Service) -> None:
        self.page = page
        self.service = service
        self.url = f"http://127.0.0.1:{service.port}"
        self.foreign: list[str] = []
        """Requests to other machines; they are answered by nobody."""
        self.errors: list[str] = []
        """What the page or the browser complained of."""
        self.tolerated: tuple[str, ...] = ()
        """Parts of complaints that a test causes itself."""

    def open(self, path: str = "/") -> None:
        """Show a page by its route, within the loaded page."""
        self.page.evaluate("path => { location.hash = '#' + path; }", path)

    def surgery(self, surgery_id: str) -> None:
        """Show the page of a surgery."""
        self.open(f"/surgeries/{surgery_id}")
        expect(self.page.get_by_role("navigation", name="Stages")).to_be_visible()

    def sign_in(self) -> None:
        """Open the address that `spinewatch run` prints."""
        self.page.goto(f"{self.url}/#key={self.service.key}")
        expect(self.page.get_by_role("button", name="Sign out")).to_be_visible()

    def stage(self, name: str) -> Locator:
        """Return a stage in the time line."""
        return self.page.get_by_role("navigation", name="Stages").get_by_role("link").filter(has_text=name)

    def screenshot(self, name: str, *, full_page: bool = False) -> Path:
        """Keep an image of the window as an artefact."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        path = SCREENSHOTS / f"{name}.png"
        self.page.screenshot(path=path, full_page=full_page)
        return path

    def tab_to(self, target: Locator, most: int = 150) -> None:
        """Press Tab until an element has the focus; the focus is visible on the way."""
        expect(target).to_be_visible()
        for _ in range(most):
            self.page.keyboard.press("Tab")
            shown = self.page.evaluate(
                "() => { const style = getComputedStyle(document.activeElement);"
                " return document.activeElement === document.body || style.outlineStyle !== 'none'; }"
            )
            assert shown, self.page.evaluate("document.activeElement.outerHTML")
            if target.evaluate("element => element === document.activeElement"):
                return
        raise AssertionError(f"{most} times Tab does not reach {target}")

    def check(self) -> None:
        """Check that nothing happened that must never happen."""
        violations = self.page.evaluate("window.violations")
        assert violations == [], violations
        assert self.foreign == [], self.foreign
        unexpected = [error for error in self.errors if not any(part in error for part in self.tolerated)]
        assert unexpected == [], unexpected

    def note_request(self, route: Route) -> None:
        request: Request = route.request
        if urlsplit(request.url).hostname in {"127.0.0.1", None}:
            route.fallback()
        else:
            self.foreign.append(request.url)
            route.abort()

    def note_console(self, message: ConsoleMessage) -> None:
        if message.type == "error" and not any(part in message.text for part in _EXPECTED):
            self.errors.append(message.text)


@contextmanager
def visiting(browser: Browser, service: Service, *, theme: str, signed_in: bool) -> Iterator[Visitor]:
    """Open a window with a memory of its own; the end checks what the page did there."""
    context = browser.new_context(viewport={"width": _SIZE[0], "height": _SIZE[1]}, reduced_motion="reduce")
    context.set_default_timeout(_PATIENCE_MS)
    expect.set_options(timeout=_PATIENCE_MS)
    context.add_init_script(_WATCH)
    context.add_init_script(_THEME.replace("THEME", theme))
    page = context.new_page()
    visitor = Visitor(page, service)
    page.on("console", visitor.note_console)
    page.on("pageerror", lambda error: visitor.errors.append(str(error)))
    # from the start: beside a key press, Chromium may get the key first and open a chooser that the test never sees
    page.on("filechooser", lambda chooser: None)
    page.on("dialog", lambda dialog: visitor.errors.append(f"dialog: {dialog.message}"))
    context.route("**/*", visitor.note_request)
    try:
        if signed_in:
            visitor.sign_in()
        else:
            page.goto(f"{visitor.url}/")
            expect(page.get_by_label("API key")).to_be_visible()
        yield visitor
        visitor.check()
    finally:
        context.close()
