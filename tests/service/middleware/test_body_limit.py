import asyncio
from collections.abc import AsyncIterator

import pytest
from fastapi import FastAPI, Request
from starlette.types import Receive, Scope, Send

from service import problems
from service.declared_routes import SCOPE_KEY
from service.middleware.body_limit import BodyLimit
from tests.service.middleware.asgi import request

LIMIT = 1000


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()

    @app.post("/")
    async def echo_length(request: Request) -> int:
        return len(await request.body())

    problems.install(app)
    app.add_middleware(BodyLimit, max_bytes=lambda scope: LIMIT, timeout_s=0.2)
    return app


async def chunks(total: int, size: int = 100) -> AsyncIterator[bytes]:
    for start in range(0, total, size):
        yield b"x" * min(size, total - start)


@pytest.mark.parametrize("length", [0, 1, LIMIT])
def test_a_body_up_to_the_limit_arrives(app: FastAPI, length: int) -> None:
    assert request(app, "POST", content=b"x" * length).json() == length
    assert request(app, "POST", content=chunks(length)).json() == length


@pytest.mark.parametrize("length", [LIMIT + 1, 5 * LIMIT])
def test_a_larger_body_is_answered_with_413(app: FastAPI, length: int) -> None:
    for content in (b"x" * length, chunks(length)):
        response = request(app, "POST", content=content)
        assert response.status_code == 413
        assert response.headers["content-type"] == "application/problem+json"
        assert f"larger than {LIMIT} bytes" in response.json()["detail"]


def test_a_content_length_that_is_not_a_number_is_not_trusted(app: FastAPI) -> None:
    response = request(app, "POST", content=b"x" * (LIMIT + 1), headers={"Content-Length": "-1"})
    assert response.status_code == 413


async def stalled(first: bytes) -> AsyncIterator[bytes]:
    yield first
    await asyncio.sleep(30)
    yield b"x"


def test_a_body_that_stalls_is_answered_with_408_and_the_connection_closed(app: FastAPI) -> None:
    response = request(app, "POST", content=stalled(b"x"))
    assert response.status_code == 408
    assert response.headers["connection"] == "close"
    assert response.headers["content-type"] == "application/problem+json"


def test_what_has_arrived_extends_the_time(app: FastAPI, monkeypatch: pytest.MonkeyPatch) -> None:
    async def steady() -> AsyncIterator[bytes]:
        for _ in range(4):
            await asyncio.sleep(0.1)
            yield b"x" * 100

    monkeypatch.setattr("service.middleware.body_limit.MIN_BODY_RATE", 100)
    assert request(app, "POST", content=steady()).json() == 400


def test_a_length_is_refused_before_anything_is_read(app: FastAPI) -> None:
    async def unread() -> AsyncIterator[bytes]:
        yield b"x" * int("the body was read")

    response = request(app, "POST", content=unread(), headers={"Content-Length": str(LIMIT + 1)})
    assert response.status_code == 413


def test_a_path_without_a_route_is_left_to_the_router(app: FastAPI) -> None:
    async def without_route(scope: Scope, receive: Receive, send: Send) -> None:
        await app({**scope, SCOPE_KEY: None}, receive, send)

    response = request(without_route, "POST", "/nothing", content=b"x" * (LIMIT + 1))
    assert response.status_code == 404
