from collections.abc import AsyncIterator

import pytest
from fastapi import APIRouter, FastAPI, Request

from service.declared_routes import DeclaredRoutes
from service.middleware.declared_request import DeclaredRequest
from service.middleware.json_check import JSONCheck
from tests.service.middleware.asgi import request

JSON = {"Content-Type": "application/json"}
router = APIRouter()


@router.post("/")
def count(body: dict[str, int]) -> int:
    return len(body)


@router.post("/raw", openapi_extra={"requestBody": {"content": {"text/csv": {}}}})
async def raw(request: Request) -> int:
    return len(await request.body())


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()
    app.include_router(router)
    app.add_middleware(JSONCheck)
    app.add_middleware(DeclaredRequest, routes=DeclaredRoutes(router.routes))
    return app


async def pieces(text: bytes) -> AsyncIterator[bytes]:
    for position in range(len(text)):
        yield text[position : position + 1]


def test_a_body_in_pieces_is_handed_on_whole(app: FastAPI) -> None:
    assert request(app, "POST", content=pieces(b'{"a": 1, "b": 2}'), headers=JSON).json() == 2


def test_what_is_refused_never_reaches_the_route(app: FastAPI) -> None:
    response = request(app, "POST", content=b'{"a": NaN, "<b>": 1e999}', headers=JSON)
    assert response.status_code == 422
    problem = response.json()
    assert problem["type"] == "urn:spinewatch:problem:invalid-request"
    assert [error["loc"] for error in problem["errors"]] == [["body", "a"], ["body", "(unprintable)"]]


def test_an_empty_body_is_left_to_the_schema(app: FastAPI) -> None:
    assert request(app, "POST", headers=JSON).json()["detail"][0]["type"] == "missing"


def test_other_media_types_are_not_read(app: FastAPI) -> None:
    assert request(app, "POST", "/raw", content=b"NaN,", headers={"Content-Type": "text/csv"}).json() == 4
