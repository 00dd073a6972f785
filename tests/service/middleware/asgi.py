"""ASGI applications without a server."""

import asyncio
from typing import Any

import httpx
from starlette.types import ASGIApp


def request(app: ASGIApp, method: str, path: str = "/", **options: Any) -> httpx.Response:
    """Return the response of an application to one request."""

    async def send() -> httpx.Response:
        transport = httpx.ASGITransport(app, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            return await client.request(method, path, **options)

    return asyncio.run(send())
