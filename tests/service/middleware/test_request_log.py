import asyncio
from typing import Any

import pytest
import structlog
from fastapi import APIRouter, FastAPI, HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import Receive, Scope, Send

from service.declared_routes import DeclaredRoutes
from service.middleware.request_log import RequestLog
from tests.service.middleware.asgi import request


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()

    @app.get("/fine")
    def show() -> str:
        return "fine"

    @app.get("/broken")
    def fail() -> str:
        raise RuntimeError("a secret of the implementation")

    app.add_middleware(RequestLog)
    return app


def test_one_line_per_request_without_its_query(app: FastAPI) -> None:
    with structlog.testing.capture_logs() as lines:
        response = request(app, "GET", "/fine?case=17")
    (line,) = lines
    assert (line["event"], line["method"], line["path"], line["status"]) == ("request", "GET", "/fine", 200)
    assert line["ms"] >= 0
    assert "17" not in str({**line, "ms": None})
    assert len(response.headers["x-request-id"]) == 36


@pytest.mark.parametrize(
    ("sent", "kept"), [("cart-7_1", True), ("a b;c", False), ("x" * 65, False), ("", False)]
)
def test_a_valid_identifier_is_kept(app: FastAPI, sent: str, kept: bool) -> None:
    response = request(app, "GET", "/fine", headers={"X-Request-ID": sent})
    assert (response.headers["x-request-id"] == sent) == kept


def test_an_unexpected_error_is_logged_and_answered_with_a_problem(app: FastAPI) -> None:
    with structlog.testing.capture_logs() as lines:
        response = request(app, "GET", "/broken", headers={"X-Request-ID": "r1"})
    assert [line["event"] for line in lines] == ["unexpected_error", "request"]
    assert lines[1]["status"] == 500
    assert response.status_code == 500
    assert response.json()["instance"] == "urn:spinewatch:request:r1"
    assert "r1" in response.json()["detail"]
    assert "secret" not in response.text


def test_polls_are_logged_as_debug_unless_they_fail() -> None:
    broken: list[bool] = []
    router = APIRouter()

    @router.get("/v1/jobs/{job_id}")
    def get_job(job_id: str) -> str:
        if broken:
            raise HTTPException(503)
        return job_id

    @router.post("/v1/jobs/{job_id}")
    def change(job_id: str) -> str:
        return job_id

    app = FastAPI()
    app.include_router(router)
    app.add_middleware(RequestLog, routes=DeclaredRoutes(router.routes))
    with structlog.testing.capture_logs() as lines:
        request(app, "GET", "/v1/jobs/7")
        request(app, "POST", "/v1/jobs/7")
        request(app, "GET", "/v1/nothing")
        broken.append(True)
        request(app, "GET", "/v1/jobs/7")
    assert [(line["status"], line["log_level"]) for line in lines] == [
        (200, "debug"),
        (200, "info"),
        (404, "info"),
        (503, "info"),
    ]


def test_every_request_is_counted_by_its_declared_path() -> None:
    router = APIRouter()

    @router.get("/v1/jobs/{job_id}")
    def get_job(job_id: str) -> str:
        return job_id

    counted: list[tuple[str, str | None, int]] = []
    app = FastAPI()
    app.include_router(router)
    app.add_middleware(
        RequestLog,
        routes=DeclaredRoutes(router.routes),
        count=lambda method, route, status, seconds: counted.append(
            (method, route, status if seconds >= 0 else -1)
        ),
    )
    request(app, "GET", "/v1/jobs/7")
    request(app, "HEAD", "/v1/jobs/7")
    request(app, "GET", "/v1/jobs/../../etc/passwd")
    assert counted == [
        ("GET", "/v1/jobs/{job_id}", 200),
        ("HEAD", "/v1/jobs/{job_id}", 405),
        ("GET", None, 404),
    ]


def test_a_path_cannot_begin_a_line_of_the_log(app: FastAPI) -> None:
    with structlog.testing.capture_logs() as lines:
        request(app, "GET", "/a%0a2026-11-27%20forged%1b")
    assert lines[-1]["path"] == "/a%0a2026-11-27%20forged%1b"


def test_a_client_that_has_gone_is_no_error() -> None:
    async def gone(scope: Scope, receive: Receive, send: Send) -> None:
        raise ClientDisconnect

    async def unused(*_: Any) -> Any:
        raise AssertionError("nothing is read from or sent to a client that has gone")

    scope = {"type": "http", "method": "POST", "path": "/", "raw_path": b"/", "headers": []}
    with structlog.testing.capture_logs() as lines:
        asyncio.run(RequestLog(gone)(scope, unused, unused))
    assert [line["event"] for line in lines] == ["request"]
