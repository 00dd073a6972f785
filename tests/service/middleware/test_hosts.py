import pytest
from fastapi import FastAPI

from service.middleware.hosts import AllowedHosts, host_name
from tests.service.middleware.asgi import request


@pytest.fixture
def app() -> FastAPI:
    app = FastAPI()

    @app.get("/")
    def show() -> str:
        return "fine"

    app.add_middleware(AllowedHosts, names=["0.0.0.0", "Spine.Example"])  # noqa: S104
    return app


@pytest.mark.parametrize(
    "host",
    [
        "localhost",
        "127.0.0.1:8000",
        "[::1]",
        "[::1]:8000",
        "spine.example",
        "SPINE.example:443",
        "spine.example.",
        "test",
    ],
)
def test_names_of_the_service(app: FastAPI, host: str) -> None:
    """``test`` is the address on which the connection of this client arrived."""
    assert request(app, "GET", headers={"Host": host}).json() == "fine"


@pytest.mark.parametrize(
    "host",
    ["example.org", "0.0.0.0", "spine.example.org", "spine.example@x", "", "[::1", "x y", "127.0.0.1:port"],  # noqa: S104
)
def test_other_names_are_misdirected(app: FastAPI, host: str) -> None:
    response = request(app, "GET", headers={"Host": host})
    assert response.status_code == 421
    assert response.json()["type"] == "urn:spinewatch:problem:misdirected-request"
    assert "example.org" not in response.text


def test_the_name_of_a_header() -> None:
    assert host_name("A.B:80") == "a.b"
    assert host_name("[FE80::1]:80") == "fe80::1"
    assert host_name("a/b") is None
