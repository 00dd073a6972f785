"""Heads of requests that are too long, or that two readers could read differently (request smuggling)."""

import re

import pytest

from tests.hostile.attack import connect, exchange, harmless, head, received, status
from tests.hostile.liveness import cpu_clock_s
from tests.http.harness import Service, wait_for

GET = "GET /v1/health HTTP/1.1"
POST = "POST /v1/surgeries HTTP/1.1"
KIND = "Content-Type: application/json"

LONG = {
    "one long header": (("X-Long: " + "x" * 20_000,), 431),
    "1 MB header": (("X-Long: " + "x" * 1_000_000,), 431),
    "101 headers": (tuple(f"X-{n}: 1" for n in range(101)), 431),
    "50,000 headers": (("a:b",) * 50_000, 431),
    "long cookie": (("Cookie: " + "a=b; " * 5_000,), 431),
}


@pytest.mark.parametrize(("headers", "expected"), LONG.values(), ids=LONG)
def test_too_many_headers(service: Service, headers: tuple[str, ...], expected: int) -> None:
    with harmless(service):
        answer = exchange(service, head(service, GET, *headers))
    assert status(answer) == expected
    assert b"application/problem+json" in answer


@pytest.mark.parametrize("length", [5_000, 100_000, 5_000_000])
def test_a_long_request_line(service: Service, length: int) -> None:
    with harmless(service):
        answer = exchange(service, head(service, f"GET /v1/surgeries/{'x' * length} HTTP/1.1"))
    assert status(answer) == 414


AMBIGUOUS = {
    "length and chunks": ("Content-Length: 4", "Transfer-Encoding: chunked"),
    "chunks and length": ("Transfer-Encoding: chunked", "Content-Length: 4"),
    "two lengths": ("Content-Length: 4", "Content-Length: 5"),
    "one length twice": ("Content-Length: 4", "Content-Length: 4"),
    "a list of lengths": ("Content-Length: 4, 5",),
    "a negative length": ("Content-Length: -4",),
    "a signed length": ("Content-Length: +4",),
    "a long length": ("Content-Length: " + "9" * 40,),
    "a hexadecimal length": ("Content-Length: 0x4",),
    "chunks twice": ("Transfer-Encoding: chunked", "Transfer-Encoding: chunked"),
    "another coding": ("Transfer-Encoding: gzip, chunked",),
    "a misspelt coding": ("Transfer-Encoding: xchunked",),
    "a space before the colon": ("Content-Length : 4",),
    "a folded header": ("X-Folded: a", " Content-Length: 4"),
    "a name with a space": ("X Name: 1",),
    "a name with a control character": ("X-\x01: 1",),
    "a value with NUL": ("X-Value: a\0b",),
    "two hosts": ("Host: 127.0.0.1",),
    "no name": (": value",),
    "no colon": ("Something",),
}


@pytest.mark.parametrize("headers", AMBIGUOUS.values(), ids=AMBIGUOUS)
def test_a_head_that_is_ambiguous_or_broken(service: Service, headers: tuple[str, ...]) -> None:
    smuggled = head(service, "GET /v1/smuggled HTTP/1.1")
    with harmless(service):
        answer = exchange(service, head(service, POST, KIND, *headers) + b"0\r\n\r\n" + smuggled)
    assert status(answer) in {400, 501}
    assert answer.count(b"HTTP/1.1 ") == 1
    assert b"connection: close" in answer.lower()
    assert not service.logged("smuggled")


@pytest.mark.parametrize("ending", [b"\n", b"\r", b"\r\r\n", b"\x0b\r\n"])
def test_lines_that_do_not_end_with_cr_lf(service: Service, ending: bytes) -> None:
    with harmless(service):
        answer = exchange(service, head(service, GET).replace(b"\r\n", ending), b"\r\n\r\n")
    assert status(answer) == 400


LINES = [
    "GET  /v1/health HTTP/1.1",
    "GET /v1/health HTTP/1.1 ",
    "GET /v1/health",
    "GET /v1/health HTTP/9.9",
    "GET /v1/health FTP/1.1",
    " GET /v1/health HTTP/1.1",
    "GET /v1/he\xe9lth HTTP/1.1",
    "GET /v1/hea\0lth HTTP/1.1",
    "G\x7fT /v1/health HTTP/1.1",
    "\x16\x03\x01\x02\x00",
]


@pytest.mark.parametrize("line", LINES)
def test_a_request_line_that_is_none(service: Service, line: str) -> None:
    with harmless(service):
        answer = exchange(service, head(service, line))
    assert status(answer) in {400, 505}


def test_http_1_0_with_chunks(service: Service) -> None:
    answer = exchange(service, head(service, "POST /v1/surgeries HTTP/1.0", "Transfer-Encoding: chunked"))
    assert status(answer) == 400


CHUNKS = {
    "one byte each": b"1\r\n \r\n" * 60_000 + b"0\r\n\r\n",
    "negative": b"-1\r\n",
    "not a number": b"xyz\r\n",
    "far too long": b"F" * 30 + b"\r\n",
    "bare line feeds": b"1\n \n0\n\n",
    "a long extension": b"1;" + b"x" * 1_000_000 + b"\r\n \r\n",
    "too many bytes": b"1\r\nabcdef\r\n0\r\n\r\n",
    "a large trailer": b"0\r\n" + b"X-Trailer: 1\r\n" * 100_000 + b"\r\n",
}


@pytest.mark.parametrize("chunks", CHUNKS.values(), ids=CHUNKS)
def test_chunks_that_are_broken_or_too_small(service: Service, chunks: bytes) -> None:
    with harmless(service):
        answer = exchange(service, head(service, POST, KIND, "Transfer-Encoding: chunked") + chunks)
    assert status(answer) in {400, 408, 422, 431}


def test_pipelined_requests_are_answered_in_order(service: Service) -> None:
    """They cost no more than the same requests of which each waits for the answer before it."""
    names = ["job" if n % 3 else "surgery" for n in range(100)]
    paths = {"job": "/v1/jobs/none", "surgery": "/v1/surgeries/none"}
    heads = [head(service, f"GET {paths[name]} HTTP/1.1") for name in names]

    def cost_s(*parts: list[bytes]) -> float:
        before = cpu_clock_s(service.server.pid)
        answers, expected = b"", 0
        with connect(service) as connection:
            for part in parts:
                connection.sendall(b"".join(part))
                expected += len(part)
                while answers.count(b"-not-found") < expected:
                    answers += connection.recv(65536)
        assert re.findall(r"problem:(\w+)-not-found", answers.decode()) == names
        return cpu_clock_s(service.server.pid) - before

    one_by_one = cost_s(*([one] for one in heads))
    with harmless(service, requests=len(heads)):
        pipelined = cost_s(heads)
    assert pipelined <= 2.0 * one_by_one


def test_a_request_after_a_body_that_was_not_read(service: Service) -> None:
    """What follows an early answer is the rest of its body, and then the next request."""
    first = head(service, "POST /v1/surgeries HTTP/1.1", "Content-Type: text/plain", "Content-Length: 100000")
    with connect(service) as connection:
        connection.sendall(first)
        assert status(received(connection)) == 415
        connection.sendall(b"GET /v1/smuggled HTTP/1.1\r\n\r\n".ljust(100_000) + head(service, GET))
        assert status(received(connection)) == 200
    assert not service.logged("smuggled")


def test_a_refusal_is_seen_by_a_client_that_still_sends(service: Service) -> None:
    with connect(service) as connection:
        connection.sendall(head(service, GET, "X: " + "x" * 2_000_000))
        assert status(received(connection)) == 431
    wait_for(service.ready, "the service")
