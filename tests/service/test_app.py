import asyncio
from pathlib import Path

import httpx
import pytest

from migrations.history import upgrade
from service.app import create_app
from settings import Settings


def get(settings: Settings, path: str) -> httpx.Response:
    """Return the response of the application, started and shut down as by a server."""
    app = create_app(settings)

    async def send() -> httpx.Response:
        async with app.router.lifespan_context(app):
            transport = httpx.ASGITransport(app)
            async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
                return await client.get(path)

    return asyncio.run(send())


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(database_url=f"sqlite:///{tmp_path / 'spinewatch.sqlite'}")


def test_the_application_needs_the_tables_of_this_version(settings: Settings) -> None:
    assert get(settings, "/v1/health").json()["type"] == "urn:spinewatch:problem:database-not-ready"
    upgrade(settings.database_url)
    assert get(settings, "/v1/health").json()["status"] == "ready"


def test_the_root_redirects_to_the_documentation(settings: Settings) -> None:
    response = get(settings, "/")
    assert (response.status_code, response.headers["location"]) == (307, "/docs")


def test_every_request_has_an_identifier(settings: Settings) -> None:
    response = get(settings, "/nothing")
    assert response.json()["instance"] == f"urn:spinewatch:request:{response.headers['x-request-id']}"
