"""Only requests to this service's own names are answered: no page of another name that resolves to it reads it."""

from __future__ import annotations

import re
from collections.abc import Iterable

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.problems import problem, problem_response

_LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})
_WILDCARDS = frozenset({"0.0.0.0", "::"})  # noqa: S104 - refused here
_HOST = re.compile(r"(\[(?P<v6>[0-9A-Fa-f:.]+)\]|(?P<name>[A-Za-z0-9._-]+))(:\d{1,5})?", re.ASCII)


def host_name(header: str) -> str | None:
    """Return the name or address of a Host header without its port, in lower case; None if it is none."""
    match = _HOST.fullmatch(header)
    if match is None:
        return None
    name: str = match["v6"] or match["name"]
    return name.lower().rstrip(".")


class AllowedHosts:
    """ASGI middleware that answers 421 to other hosts.

    Answered are loopback names, the address on which the connection arrived, and ``names``.
    """

    def __init__(self, app: ASGIApp, names: Iterable[str]) -> None:
        self._app = app
        self._names = (_LOOPBACK | {name.lower() for name in names}) - _WILDCARDS

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""
        if scope["type"] != "http" or self._allowed(scope):
            await self._app(scope, receive, send)
            return
        detail = "the Host header is not a name of this service; add the name to SPINEWATCH_ALLOWED_HOSTS"
        response = problem_response(scope, problem(421, detail))
        await response(scope, receive, send)

    def _allowed(self, scope: Scope) -> bool:
        headers = Headers(scope=scope).getlist("host")
        if len(headers) != 1:
            return False
        name = host_name(headers[0])
        bound = (scope.get("server") or ("",))[0]
        return name is not None and (name in self._names or name == str(bound).lower())
