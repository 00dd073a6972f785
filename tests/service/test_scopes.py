"""What every route needs; a route without an entry in the table fails here, and is closed to all but administrators."""

import pytest
from fastapi.routing import APIRoute

from contract.key import Scope
from service.app import _ROUTES
from service.scopes import OPEN_PATHS, SCOPES, UNDECLARED, is_open, needed_scopes

DECLARED = {
    f"{method} {route.path}"
    for resource in _ROUTES
    for route in resource.router.routes
    if isinstance(route, APIRoute)
    for method in route.methods or ()
}
WITHOUT_KEY = {"GET /v1/health", "GET /health/live"}


def test_every_route_declares_what_it_needs() -> None:
    assert DECLARED - set(SCOPES) == set(), "give it a scope in service/scopes.py"


def test_no_entry_is_without_a_route() -> None:
    assert set(SCOPES) - DECLARED == set()


def test_only_liveness_is_answered_without_a_key() -> None:
    assert {name for name, needed in SCOPES.items() if not needed} == WITHOUT_KEY


@pytest.mark.parametrize("name", sorted(SCOPES))
def test_no_scope_to_read_changes_anything(name: str) -> None:
    method = name.partition(" ")[0]
    needed = SCOPES[name]
    if method != "GET" and not name.endswith("/v1/session"):
        assert Scope.STAGE_READ not in needed


def test_what_is_unknown_is_closed() -> None:
    assert needed_scopes("GET", "/v1/new") == UNDECLARED == {Scope.ADMIN}
    assert needed_scopes("PATCH", "/v1/surgeries") == UNDECLARED
    assert needed_scopes("GET", None) == set(Scope)
    assert needed_scopes("HEAD", "/v1/surgeries") == needed_scopes("GET", "/v1/surgeries")


@pytest.mark.parametrize("path", sorted(OPEN_PATHS))
def test_pages_without_data_are_open_to_read(path: str) -> None:
    assert is_open("GET", path)
    assert not is_open("POST", path)


@pytest.mark.parametrize(
    "path", ["/v1/surgeries", "/docs/assets", "/docsx", "//docs", "/v1/docs", "/metrics"]
)
def test_other_paths_are_not_open(path: str) -> None:
    assert not is_open("GET", path)
