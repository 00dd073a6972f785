import asyncio
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from commands.shared.api_client import bearer
from migrations.history import upgrade
from service.app import create_app
from settings import Settings
from tests.backends import new_database
from tests.http.harness import make_key


def get(settings: Settings, path: str, key: str | None = None) -> httpx.Response:
    """Return the response of the application, started and shut down as by a server."""
    app = create_app(settings)

    async def send() -> httpx.Response:
        async with app.router.lifespan_context(app):
            transport = httpx.ASGITransport(app)
            async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
                return await client.get(path, headers=bearer(key))

    return asyncio.run(send())


@pytest.fixture
def settings(tmp_path: Path) -> Iterator[Settings]:
    with new_database(tmp_path, tables=False) as url:
        yield Settings(database_url=url)


def test_the_application_needs_the_tables_of_this_version(settings: Settings) -> None:
    unknown = "sw_aaaaaaaa_" + "a" * 52
    answer = get(settings, "/v1/health", unknown)
    assert answer.json()["type"] == "urn:spinewatch:problem:database-not-ready"
    upgrade(settings.database_url)
    assert get(settings, "/v1/health", unknown).status_code == 401
    key = make_key(settings.database_url)
    assert get(settings, "/v1/health", key).json()["status"] == "ready"


def test_without_a_key_only_liveness_answers(settings: Settings) -> None:
    assert get(settings, "/v1/health").json()["status"] == "live"
    assert get(settings, "/health/live").json()["status"] == "live"
    assert get(settings, "/v1/surgeries").status_code == 401


def test_the_root_is_the_dashboard(settings: Settings) -> None:
    response = get(settings, "/")
    assert (response.status_code, response.headers["content-type"]) == (200, "text/html; charset=utf-8")


def test_every_request_has_an_identifier(settings: Settings) -> None:
    response = get(settings, "/nothing")
    assert response.json()["instance"] == f"urn:spinewatch:request:{response.headers['x-request-id']}"


def test_streams_can_wait_for_the_end_of_the_server(settings: Settings) -> None:
    app = create_app(settings)

    async def waits() -> bool:
        async with app.router.lifespan_context(app):
            return bool(app.state.stopping.is_set())

    assert asyncio.run(waits()) is False
