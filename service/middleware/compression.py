"""Answers are compressed for clients that accept it, images and streams excepted."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_MIN_BYTES = 1024
_LEVEL = 1
"""A summary is 15% larger than at level 5, which takes more than twice the time."""


class Compression:
    """ASGI middleware that compresses answers above 1 kB; their ETag becomes a weak one (RFC 9110, 8.8.1)."""

    def __init__(self, app: ASGIApp) -> None:
        self._compressed = GZipMiddleware(
            app, _MIN_BYTES, _LEVEL, exclude_content_types=(*DEFAULT_EXCLUDED_CONTENT_TYPES, "image/*")
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""

        async def send_weak(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                tag = headers.get("etag", "W/")
                if headers.get("content-encoding") == "gzip" and not tag.startswith("W/"):
                    headers["etag"] = f"W/{tag}"
            await send(message)

        await self._compressed(scope, receive, send_weak)
