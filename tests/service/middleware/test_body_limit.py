from collections.abc import AsyncIterator

import pytest
from fastapi import FastAPI, Request

from service import problems
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
    app.add_middleware(BodyLimit, max_bytes=LIMIT)
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
