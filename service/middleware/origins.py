"""Pages of other origins change nothing: their requests are refused unless their origin is allowed."""

from __future__ import annotations

from collections.abc import Iterable
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.problems import problem, problem_response

_SAFE = frozenset({"GET", "HEAD", "OPTIONS", "TRACE"})
_PORTS = {"http": ":80", "https": ":443"}
_OWN_SITES = frozenset({"same-origin", "none"})


class OwnOrigin:
    """ASGI middleware that answers 403 to a request from a foreign page that may change something.

    Browsers name the page in Origin, and its relation in Sec-Fetch-Site; carts and command lines send neither.
    """

    def __init__(self, app: ASGIApp, allowed: Iterable[str]) -> None:
        self._app = app
        self._allowed = frozenset(origin.lower().rstrip("/") for origin in allowed)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or scope["method"] in _SAFE or self._own(Headers(scope=scope)):
            await self._app(scope, receive, send)
            return
        detail = (
            "the request comes from a page of another origin; open the page from this service, or add its origin to"
            " SPINEWATCH_ALLOWED_ORIGINS"
        )
        response = problem_response(scope, problem(403, detail, "foreign-origin"))
        await response(scope, receive, send)

    def _own(self, headers: Headers) -> bool:
        origins = headers.getlist("origin")
        if len(origins) == 1 and origins[0].lower() in self._allowed:
            return True
        if headers.get("sec-fetch-site", "none").lower() not in _OWN_SITES:
            return False
        return not origins or (len(origins) == 1 and same_host(origins[0], headers.get("host", "")))


def same_host(origin: str, host: str) -> bool:
    """Return whether an origin is that of the Host header; a proxy may have ended TLS, so the scheme may differ."""
    try:
        parts = urlsplit(origin.lower())
    except ValueError:
        return False
    port = _PORTS.get(parts.scheme)
    if port is None or not parts.netloc:
        return False
    return parts.netloc.removesuffix(port) == host.lower().removesuffix(port)
