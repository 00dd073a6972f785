import asyncio

import pytest
from starlette.responses import Response
from starlette.types import Message

from service.middleware.pieces import PIECE_BYTES, Pieces


def sent(body: bytes) -> list[Message]:
    """Return what the server is given for an answer with this body."""
    messages: list[Message] = []

    async def send(message: Message) -> None:
        messages.append(message)

    async def receive() -> Message:
        return {"type": "http.request", "body": b"", "more_body": False}

    scope = {"type": "http", "method": "GET", "path": "/", "headers": []}
    asyncio.run(Pieces(Response(body))(scope, receive, send))
    return messages


@pytest.mark.parametrize("size", [0, 1, PIECE_BYTES, PIECE_BYTES + 1, 3 * PIECE_BYTES, 3 * PIECE_BYTES + 7])
def test_the_pieces_are_the_body(size: int) -> None:
    body = bytes(number % 251 for number in range(size))
    head, *pieces = sent(body)
    assert head["type"] == "http.response.start"
    assert b"".join(piece["body"] for piece in pieces) == body
    assert all(len(piece["body"]) <= PIECE_BYTES for piece in pieces)
    assert [piece.get("more_body", False) for piece in pieces] == [True] * (len(pieces) - 1) + [False]
