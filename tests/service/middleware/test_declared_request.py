from typing import Annotated, Any

import httpx
import pytest
from fastapi import APIRouter, FastAPI, Header, Query

from service.declared_routes import DeclaredRoutes
from service.middleware.declared_request import DeclaredRequest
from tests.service.middleware.asgi import request

router = APIRouter()


@router.get("/v1/things/{thing}")
def show(thing: str, limit: int = 1, tag: Annotated[list[str] | None, Query()] = None) -> str:
    return thing


@router.put("/v1/setups/{thing}")
def replace(thing: str, if_match: Annotated[str | None, Header()] = None) -> str:
    return f"{thing} {if_match}"


@router.post("/v1/things")
def add(body: dict[str, int]) -> int:
    return len(body)


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI(redirect_slashes=False)
    app.include_router(router)
    app.add_middleware(DeclaredRequest, routes=DeclaredRoutes(router.routes))
    return app


def answer(app: FastAPI, method: str, path: str, **options: Any) -> tuple[int, Any]:
    response: httpx.Response = request(app, method, path, **options)
    return response.status_code, response.json()


@pytest.mark.parametrize("query", ["", "?limit=2", "?tag=a&tag=b&limit=2", "?tag="])
def test_what_is_declared_is_taken(app: FastAPI, query: str) -> None:
    assert answer(app, "GET", f"/v1/things/7{query}") == (200, "7")


@pytest.mark.parametrize(
    ("query", "name", "words"),
    [
        ("colour=blue", "colour", "takes: limit, tag"),
        ("limit=1&limit=2", "limit", "twice"),
        ("tag=a%00", "tag", "control"),
        ("<b>=1", "(unprintable)", "unknown"),
    ],
)
def test_other_queries_are_refused_by_name(app: FastAPI, query: str, name: str, words: str) -> None:
    status, problem = answer(app, "GET", f"/v1/things/7?{query}")
    assert (status, problem["type"]) == (422, "urn:spinewatch:problem:invalid-request")
    assert problem["errors"][0]["loc"] == ["query", name]
    assert words in problem["errors"][0]["msg"]


def test_errors_are_few(app: FastAPI) -> None:
    _, problem = answer(app, "GET", "/v1/things/7?" + "&".join(f"p{n}=1" for n in range(40)))
    assert len(problem["errors"]) == 20
    assert answer(app, "GET", "/v1/things/7?" + "tag=1&" * 60)[0] == 414


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Content-Type": "application/json"}, 200),
        ({"Content-Type": "Application/JSON; charset=UTF-8"}, 200),
        ({"Content-Type": 'application/json; charset="utf-8"'}, 200),
        ({"Content-Type": "application/json", "Content-Encoding": "identity"}, 200),
        ({"Content-Type": "application/json", "Expect": "100-continue"}, 200),
        ({"Content-Type": "application/json; charset=latin-1"}, 415),
        ({"Content-Type": "text/plain"}, 415),
        ({"Content-Type": "application/problem+json"}, 415),
        ({}, 415),
        ({"Content-Type": "application/json", "Content-Encoding": "gzip"}, 415),
        ({"Content-Type": "application/json", "Expect": "more"}, 417),
    ],
)
def test_headers_of_a_body(app: FastAPI, headers: dict[str, str], status: int) -> None:
    assert answer(app, "POST", "/v1/things", content=b'{"a": 1}', headers=headers)[0] == status


def test_another_method_is_answered_with_the_allowed_ones(app: FastAPI) -> None:
    response = request(app, "DELETE", "/v1/things/7")
    assert (response.status_code, response.headers["allow"]) == (405, "GET, HEAD")


def test_a_slash_at_the_end_is_explained(app: FastAPI) -> None:
    status, problem = answer(app, "GET", "/v1/things/7/")
    assert status == 404
    assert problem["detail"].endswith("/v1/things/{thing}")
    assert answer(app, "GET", "/v1/nothing/")[0] == 404


def test_a_control_character_in_the_path_is_refused(app: FastAPI) -> None:
    assert answer(app, "GET", "/v1/things/a%00b")[0] == 400
    assert answer(app, "GET", "/v1/things/a%0Ab")[0] == 400


def test_a_condition_is_refused_where_it_is_not_compared(app: FastAPI) -> None:
    headers = {"If-Match": '"a"'}
    assert answer(app, "PUT", "/v1/setups/7", headers=headers) == (200, '7 "a"')
    status, problem = answer(app, "GET", "/v1/things/7", headers=headers)
    assert (status, problem["type"]) == (412, "urn:spinewatch:problem:precondition-failed")


@pytest.mark.parametrize("name", ["Content-Type", "idempotency-key", "Last-Event-ID"])
def test_a_header_that_is_given_twice_is_refused_by_name(app: FastAPI, name: str) -> None:
    status, problem = answer(app, "GET", "/v1/things/7", headers=[(name, "a"), (name, "a")])
    assert status == 400
    assert name.lower() in problem["detail"].lower()
