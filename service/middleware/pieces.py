"""Answers are sent in pieces, so that a client that does not read holds one of them and not the whole answer."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send

PIECE_BYTES = 2**15


class Pieces:
    """ASGI middleware that sends a large body in pieces; the server sends the next one when the client reads."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle one request."""

        async def send_pieces(message: Message) -> None:
            body = message.get("body", b"")
            if message["type"] != "http.response.body" or len(body) <= PIECE_BYTES:
                await send(message)
                return
            last = (len(body) - 1) // PIECE_BYTES * PIECE_BYTES
            for start in range(0, last, PIECE_BYTES):
                piece = body[start : start + PIECE_BYTES]
                await send({**message, "body": piece, "more_body": True})
            await send({**message, "body": body[last:]})

        await self._app(scope, receive, send_pieces)
