import pytest
import structlog
from fastapi import FastAPI

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
