import pytest
from fastapi import FastAPI

from service.middleware.origins import OwnOrigin, same_host
from tests.service.middleware.asgi import request


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()

    @app.api_route("/", methods=["GET", "POST", "PUT", "DELETE"])
    def act() -> str:
        return "fine"

    app.add_middleware(OwnOrigin, allowed=["https://Dashboard.example/"])
    return app


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Origin": "http://test"},
        {"Origin": "https://test:443", "Sec-Fetch-Site": "same-origin"},
        {"Sec-Fetch-Site": "none"},
        {"Origin": "https://dashboard.example", "Sec-Fetch-Site": "cross-site"},
    ],
)
def test_own_and_allowed_pages_may_change_something(app: FastAPI, headers: dict[str, str]) -> None:
    assert request(app, "POST", headers=headers).status_code == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE"])
@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://example.org"},
        {"Origin": "null"},
        {"Origin": "http://test:8000"},
        {"Origin": "http://dashboard.example"},
        {"Origin": "http://test", "Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_foreign_pages_may_not(app: FastAPI, method: str, headers: dict[str, str]) -> None:
    response = request(app, method, headers=headers)
    assert response.status_code == 403
    assert response.json()["type"] == "urn:spinewatch:problem:foreign-origin"
    assert request(app, "GET", headers=headers).status_code == 200


@pytest.mark.parametrize(
    ("origin", "host", "same"),
    [
        ("http://a", "A:80", True),
        ("https://a", "a", True),
        ("https://a:8443", "a:8443", True),
        ("http://a", "b", False),
        ("http://a:80", "a:8000", False),
        ("http://", "", False),
        ("ftp://a", "a", False),
        ("http://[::1", "[::1", False),
    ],
)
def test_whether_an_origin_is_that_of_the_host(origin: str, host: str, same: bool) -> None:
    assert same_host(origin, host) is same
