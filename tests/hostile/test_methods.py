"""Methods, expectations, upgrades and targets that the service does not know."""

import pytest

from tests.hostile.attack import connect, exchange, harmless, head, received, status
from tests.http.harness import Service

REFUSED = {
    "unknown method": ("FROBNICATE /v1/surgeries HTTP/1.1", 405),
    "lower case": ("get /v1/health HTTP/1.1", 405),
    "long method": ("X" * 3_000 + " /v1/health HTTP/1.1", 405),
    "TRACE": ("TRACE /v1/health HTTP/1.1", 405),
    "DEBUG": ("DEBUG /v1/health HTTP/1.1", 405),
    "PROPFIND": ("PROPFIND /v1/surgeries HTTP/1.1", 405),
    "CONNECT": ("CONNECT example.org:443 HTTP/1.1", 400),
    "absolute target": ("GET http://example.org/v1/health HTTP/1.1", 400),
    "asterisk": ("OPTIONS * HTTP/1.1", 400),
    "HTTP/2 preface": ("PRI * HTTP/2.0", 505),
}


@pytest.mark.parametrize(("line", "expected"), REFUSED.values(), ids=REFUSED)
def test_a_method_or_target_is_refused(service: Service, line: str, expected: int) -> None:
    with harmless(service):
        answer = exchange(service, head(service, line))
    assert status(answer) in {expected, 401}
    assert b"application/problem+json" in answer


@pytest.mark.parametrize("protocol", ["websocket", "h2c", "TLS/1.3", "x" * 500])
def test_an_upgrade_is_not_taken(service: Service, protocol: str) -> None:
    headers = (
        f"Upgrade: {protocol}",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: eA==",
    )
    with harmless(service):
        answer = exchange(service, head(service, "GET /v1/nothing HTTP/1.1", *headers))
    assert status(answer) == 404


def test_expect_100_continue(service: Service) -> None:
    """The server asks for the body only of a request that it may take."""
    body = b'{"reference": "case-1", "vertebrae": ["L1"], "reference_vertebra": "L1", "spine_axis": "x"}'
    length = f"Content-Length: {len(body)}"
    line, expect = "POST /v1/surgeries HTTP/1.1", "Expect: 100-continue"
    with connect(service) as connection:
        connection.sendall(head(service, line, expect, "Content-Type: application/json", length))
        assert connection.recv(65536).startswith(b"HTTP/1.1 100 ")
        connection.sendall(body)
        assert status(received(connection)) in {201, 422}
    refused = (
        ("Content-Type: text/plain", length, 415),
        ("Content-Type: application/json", "Content-Length: 9000000", 413),
    )
    for kind, announced, expected in refused:
        assert status(exchange(service, head(service, line, expect, kind, announced))) == expected


def test_another_expectation_is_refused(service: Service) -> None:
    assert status(exchange(service, head(service, "GET /v1/surgeries HTTP/1.1", "Expect: a-reply"))) == 417


@pytest.mark.parametrize(
    "header",
    [
        "Range: bytes=0-" + ",0-" * 1_000,
        "Accept: " + "text/html," * 1_000,
        "Accept-Encoding: " + "gzip," * 1_500,
    ],
)
def test_a_list_in_a_header(service: Service, header: str) -> None:
    with harmless(service):
        answer = exchange(service, head(service, "GET /v1/jobs/none HTTP/1.1", header))
    assert status(answer) == 404
