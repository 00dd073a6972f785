import asyncio
import sys
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from service import openapi
from service.dependencies import problems


def test_problems_are_declared_as_problem_json() -> None:
    app = FastAPI()

    @app.get("/things/{number}", responses=problems(404))
    def show(number: int) -> None: ...

    openapi.install(app)
    for _ in range(2):
        document = app.openapi()
        responses = document["paths"]["/things/{number}"]["get"]["responses"]
        assert set(responses) == {"200", "401", "403", "404", "429", "500", "503"}
        schema = {"$ref": "#/components/schemas/Problem"}
        assert responses["404"]["content"] == {"application/problem+json": {"schema": schema}}
        assert "HTTPValidationError" not in document["components"]["schemas"]


def test_the_document_is_made_when_it_is_asked_for() -> None:
    app = FastAPI()
    made: list[int] = []

    @app.get("/things/{number}", responses=problems(404))
    def show(number: int) -> None: ...

    generate = app.openapi

    def counted() -> dict[str, Any]:
        made.append(1)
        return generate()

    app.openapi = counted  # type: ignore[method-assign]
    openapi.install(app)
    assert not made

    async def get() -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://service") as client:
            return await client.get("/openapi.json")

    first = asyncio.run(get())
    asked = len(made)
    assert asked > 0
    assert asyncio.run(get()).content == first.content
    assert len(made) == asked
    assert first.headers["content-type"] == "application/json"
    assert first.json() == app.openapi()


def test_the_committed_document_is_written_and_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(openapi, "CONTRACT", tmp_path / "openapi" / "openapi.json")
    command, check = ["openapi"], ["openapi", "--check"]
    for arguments, status in ((check, 1), (command, 0), (check, 0)):
        monkeypatch.setattr(sys, "argv", arguments)
        assert openapi.main() == status
    openapi.CONTRACT.write_text("{}")
    assert openapi.main() == 1
