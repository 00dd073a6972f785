import h11
import pytest

from service.http_head import StrictConnection, refused_head
from service.limits import MAX_HEAD_BYTES, MAX_HEADERS, MAX_TARGET_BYTES

LINE = b"POST /v1/surgeries HTTP/1.1\r\n"
HOST = b"Host: x\r\n"


def head(*lines: bytes) -> bytes:
    return LINE + HOST + b"".join(line + b"\r\n" for line in lines) + b"\r\n"


@pytest.mark.parametrize(
    "complete", [head(), head(b"Content-Length: 4"), head(b"Transfer-Encoding: chunked")]
)
def test_a_plain_head_is_read_at_any_break(complete: bytes) -> None:
    for length in range(len(complete) + 1):
        assert refused_head(complete[:length]) is None
    assert refused_head(complete + b"a\nb") is None  # the body


@pytest.mark.parametrize(
    ("received", "status"),
    [
        (b"GET /" + b"x" * MAX_TARGET_BYTES, 414),
        (LINE + b"X: " + b"x" * MAX_HEAD_BYTES, 431),
        (LINE + b"a:b\r\n" * (MAX_HEADERS + 1), 431),
        (LINE + b"X: a\nHost: x", 400),
        (LINE + b"X: a\rHost: x", 400),
        (LINE + b"X: a\r\n b", 400),
        (LINE + b"X: a\r\n\tb", 400),
        (head(b"Content-Length: 1", b"Transfer-Encoding: chunked"), 400),
        (head(b"content-length: 1", b"CONTENT-LENGTH: 1"), 400),
        (head(b"Transfer-Encoding: chunked", b"Transfer-Encoding: chunked"), 400),
        (head(b"Host: y"), 400),
        (b"POST / HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n", 400),
        (b"GET / HTTP/2.0\r\n\r\n", 505),
    ],
)
def test_what_is_refused(received: bytes, status: int) -> None:
    refused = refused_head(received)
    assert refused is not None
    assert refused[0] == status


def test_the_errors_of_h11_are_kept_too() -> None:
    connection = StrictConnection()
    connection.receive_data(b"GARBAGE\r\n\r\n")
    with pytest.raises(h11.RemoteProtocolError):
        connection.next_event()
    assert connection.refused is not None
    assert connection.refused[0] == 400


@pytest.mark.parametrize(("size", "taken"), [(1, False), (255, False), (256, True), (65_536, True)])
def test_chunks_must_not_be_small(size: int, taken: bool) -> None:
    connection = StrictConnection()
    connection.receive_data(head(b"Transfer-Encoding: chunked"))
    assert isinstance(connection.next_event(), h11.Request)
    chunk = b"%x\r\n%b\r\n" % (size, b"x" * size)
    try:
        for _ in range(100_000 if not taken else 600):
            connection.receive_data(chunk)
            while connection.next_event() is not h11.NEED_DATA:
                pass
    except h11.RemoteProtocolError:
        assert not taken
        assert connection.refused is not None
        assert "chunks" in connection.refused[1]
    else:
        assert taken
