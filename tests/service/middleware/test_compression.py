import gzip

import anyio
from starlette.responses import Response
from starlette.types import Message

from service.middleware.compression import Compression

LARGE = b'{"numbers": [' + b"1234567, " * 1000 + b"0]}"


def answer(response: Response, accepts: bytes = b"gzip") -> tuple[dict[str, str], bytes]:
    """Return the headers and the body of a compressed answer."""
    messages: list[Message] = []

    async def run() -> None:
        async def receive() -> Message:
            return {"type": "http.request", "body": b"", "more_body": False}

        async def send(message: Message) -> None:
            messages.append(message)

        scope = {"type": "http", "method": "GET", "headers": [(b"accept-encoding", accepts)]}
        await Compression(response)(scope, receive, send)

    anyio.run(run)
    headers = {name.decode(): value.decode() for name, value in messages[0]["headers"]}
    return headers, b"".join(message.get("body", b"") for message in messages[1:])


def test_json_is_compressed_and_its_etag_is_weak() -> None:
    headers, body = answer(Response(LARGE, media_type="application/json", headers={"ETag": '"a"'}))
    assert headers["content-encoding"] == "gzip"
    assert headers["etag"] == 'W/"a"'
    assert "accept-encoding" in headers["vary"].lower()
    assert gzip.decompress(body) == LARGE


def test_what_is_small_or_not_accepted_is_sent_as_it_is() -> None:
    for response, accepts in (
        (Response(LARGE[:1000], media_type="application/json", headers={"ETag": '"a"'}), b"gzip"),
        (Response(LARGE, media_type="application/json", headers={"ETag": '"a"'}), b"identity"),
    ):
        headers, body = answer(response, accepts)
        assert "content-encoding" not in headers
        assert headers["etag"] == '"a"'
        assert body == response.body


def test_images_and_streams_are_not_compressed() -> None:
    for media_type in ("image/tiff", "image/png", "image/x-sun-raster", "text/event-stream"):
        headers, body = answer(Response(LARGE, media_type=media_type, headers={"ETag": '"a"'}))
        assert "content-encoding" not in headers
        assert headers["etag"] == '"a"'
        assert body == LARGE
