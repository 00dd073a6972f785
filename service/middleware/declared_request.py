"""Requests are compared with what their route declares before anything of the body is read."""

from __future__ import annotations

from collections import Counter
from email.message import Message as HeaderParser
from urllib.parse import parse_qsl

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from contract.problem import Problem
from service.declared_routes import CONTROL, SCOPE_KEY, DeclaredRoute, DeclaredRoutes
from service.limits import MAX_QUERY_PARAMETERS
from service.problems import field_errors, problem, problem_response

_UTF_8 = frozenset({"utf-8", "utf8"})
_SINGLE = ("Content-Type", "Idempotency-Key", "Last-Event-ID")
"""Headers of which a request has one: of two, clients and proxies may mean either."""
_Answer = tuple[Problem, dict[str, str]]


class DeclaredRequest:
    """ASGI middleware that refuses paths, queries, media types and encodings that no route declares.

    Any other path goes on to the router, which reads no body either.
    """

    def __init__(self, app: ASGIApp, routes: DeclaredRoutes) -> None:
        self._app = app
        self._routes = routes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        path: str = scope["path"]
        route = self._routes.find(scope["method"], path)
        refused = _everywhere(scope)
        if refused is None:
            refused = self._unknown(path) if route is None else _declared(route, scope)
        if refused is not None:
            response = problem_response(scope, refused[0], refused[1])
            await response(scope, receive, send)
            return
        await self._app({**scope, SCOPE_KEY: route}, receive, send)

    def _unknown(self, path: str) -> _Answer | None:
        """Return why a path without a route of this method is refused, where the router cannot say it."""
        methods = self._routes.methods(path)
        if methods:
            detail = "this path does not support this method; see the Allow header"
            return problem(405, detail), {"Allow": ", ".join(methods)}
        template = self._routes.template(path.rstrip("/"))
        if template is None or not path.endswith("/"):
            return None
        return problem(404, f"there is no such path; leave out the slash at the end: {template}"), {}


def _everywhere(scope: Scope) -> _Answer | None:
    """Return why a request is refused at any path."""
    if not scope["path"].startswith("/") or CONTROL.search(scope["path"]):
        return problem(400, "the path has no slash at its start, or a control character; see /docs"), {}
    headers = Headers(scope=scope)
    repeated = [name for name in _SINGLE if len(headers.getlist(name)) > 1]
    if repeated:
        return problem(400, f"the header {repeated[0]} is given twice; keep one"), {}
    expected = headers.get("expect", "100-continue").lower()
    if expected != "100-continue":
        return problem(417, "only Expect: 100-continue is known; leave the header out"), {}
    return None


def _declared(route: DeclaredRoute, scope: Scope) -> _Answer | None:
    """Return why a route does not take a request."""
    return _query(route, scope) or _precondition(route, scope) or _body(route, scope)


def _precondition(route: DeclaredRoute, scope: Scope) -> _Answer | None:
    """Return why a request that depends on If-Match is not carried out where nobody compares it (RFC 9110, 13.1.1)."""
    if route.takes_if_match or "if-match" not in Headers(scope=scope):
        return None
    return problem(
        412, "this path does not compare If-Match, so that nothing was done; leave the header out"
    ), {}


def _query(route: DeclaredRoute, scope: Scope) -> _Answer | None:
    """Return which query parameters the route does not take."""
    text = scope["query_string"].decode("latin-1")
    if text.count("&") >= MAX_QUERY_PARAMETERS:
        return problem(414, f"more than {MAX_QUERY_PARAMETERS} query parameters; send fewer"), {}
    pairs = parse_qsl(text, keep_blank_values=True)
    known = ", ".join(sorted(route.query)) or "none"
    wrong: list[tuple[tuple[str, str], str, str]] = []
    for name, count in Counter(name for name, _ in pairs).items():
        if name not in route.query:
            wrong.append(
                (("query", name), f"unknown parameter; this path takes: {known}", "unknown_parameter")
            )
        elif count > 1 and not route.query[name]:
            wrong.append((("query", name), "the parameter is given twice; keep one", "parameter_repeated"))
    for name, value in pairs:
        if name in route.query and CONTROL.search(value):
            wrong.append((("query", name), "a control character; remove it", "control_character"))
    if not wrong:
        return None
    detail = "the query does not match what this path takes; see errors"
    return problem(422, detail, "invalid-request", field_errors(wrong)), {}


def _body(route: DeclaredRoute, scope: Scope) -> _Answer | None:
    """Return why the body of a request cannot be taken, from its headers alone."""
    headers = Headers(scope=scope)
    if headers.get("content-encoding", "identity").strip().lower() != "identity":
        detail = "compressed bodies are not taken; send the body without Content-Encoding"
        return problem(415, detail), {"Accept-Encoding": "identity"}
    if route.media_type is None:
        return None
    sent = HeaderParser()
    sent["content-type"] = headers.get("content-type", "")
    if headers.get("content-type", "").partition(";")[0].strip().lower() != route.media_type:
        return problem(415, f"send this request as {route.media_type}"), {"Accept": route.media_type}
    charset = sent.get_content_charset()
    if charset is not None and charset not in _UTF_8:
        return problem(415, "only UTF-8 is taken; send the body as charset=utf-8"), {
            "Accept": route.media_type
        }
    return None
