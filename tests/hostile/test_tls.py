"""Clients of a service with TLS that never finish a handshake, or do not speak TLS."""

import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from tests.hostile.attack import connect, head, received, status
from tests.http.harness import Service


@pytest.fixture(scope="module")
def secure(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    folder = tmp_path_factory.mktemp("secure")
    cert, key = folder / "cert.pem", folder / "key.pem"
    options = "req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=127.0.0.1"
    names = ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(cert)]
    subprocess.run(["openssl", *options.split(), *names], capture_output=True, check=True)
    files = {"SPINEWATCH_TLS_CERT": str(cert), "SPINEWATCH_TLS_KEY": str(key)}
    service = Service(folder, SPINEWATCH_HEADER_TIMEOUT_SECONDS="2", **files)
    service.client.close()
    service.client = httpx.Client(
        base_url=f"https://127.0.0.1:{service.port}", verify=trusting(cert), timeout=30, trust_env=False
    )
    with service:
        yield service


def trusting(cert: Path) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=str(cert))


@pytest.mark.parametrize("sent", [b"", b"\x16\x03\x01", b"GET / HTTP/1.1\r\n\r\n", b"\x00" * 1_000])
def test_a_handshake_that_does_not_come(secure: Service, sent: bytes) -> None:
    with connect(secure) as connection:
        connection.sendall(sent)
        began = time.monotonic()
        answer = received(connection)
    assert not answer.startswith(b"HTTP")
    assert time.monotonic() - began < 30
    assert secure.client.get("/health/live").status_code == 200


def test_many_silent_clients_lock_nobody_out(secure: Service) -> None:
    silent: list[socket.socket] = []
    try:
        silent.extend(connect(secure) for _ in range(1_100))
        assert secure.client.get("/health/live").status_code == 200
    finally:
        for connection in silent:
            connection.close()


def test_a_refusal_arrives_through_tls(secure: Service) -> None:
    cert = Path(secure.environment["SPINEWATCH_TLS_CERT"])
    with (
        connect(secure) as plain,
        trusting(cert).wrap_socket(plain, server_hostname="127.0.0.1") as connection,
    ):
        connection.sendall(head(secure, "GET /health/live HTTP/1.1", "X: " + "x" * 17_000))
        assert status(received(connection)) == 431
