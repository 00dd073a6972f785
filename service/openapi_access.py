"""Access in the OpenAPI document: the security schemes, and what each operation needs."""

from __future__ import annotations

from typing import Any

from contract.key import Scope
from service.access import COOKIE
from service.scopes import is_open, needed_scopes

_SCHEMES = {
    "key": {
        "type": "http",
        "scheme": "bearer",
        "description": "An API key, from `spinewatch key create` or POST /v1/keys. Each alternative of"
        " an operation names a scope that suffices; `admin` includes the others.",
    },
    "session": {
        "type": "apiKey",
        "in": "cookie",
        "name": COOKIE,
        "description": "The session of a browser, from POST /v1/session. Changes are permitted to pages of the service"
        " alone.",
    },
}
_RESPONSES = {
    "401": "No valid API key or session was sent.",
    "403": "The key lacks the scope, or the request comes from a page of another origin.",
    "429": "Too many failed attempts from this address, or too many streams and waiting requests of this key.",
}
_SESSION_START = "POST /v1/session"


def declare_access(document: dict[str, Any]) -> None:
    """Add the security schemes to an OpenAPI document, and to each operation what it needs."""
    document.setdefault("components", {}).setdefault("securitySchemes", {}).update(_SCHEMES)
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            name = method.upper()
            needed = needed_scopes(name, path)
            if is_open(name, path) or not needed:
                operation["security"] = []
                continue
            schemes = ("key",) if f"{name} {path}" == _SESSION_START else ("key", "session")
            scopes = [[]] if needed == frozenset(Scope) else [[scope.value] for scope in sorted(needed)]
            operation["security"] = [{scheme: one} for scheme in schemes for one in scopes]
            for status, description in _RESPONSES.items():
                schema = {"$ref": "#/components/schemas/Problem"}
                operation["responses"].setdefault(
                    status,
                    {"description": description, "content": {"application/problem+json": {"schema": schema}}},
                )
