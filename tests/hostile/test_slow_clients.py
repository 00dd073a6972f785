"""Clients that send or read a little at a time, to hold what they have opened."""

import select
import socket
import time
from collections.abc import Callable
from contextlib import ExitStack

import pytest

from contract.key import Scope
from service.turns import MAX_WRITERS
from tests.hostile.attack import (
    MAX_MEMORY_BYTES,
    PATIENCE_S,
    connect,
    forget_peak,
    harmless,
    head,
    peak_memory,
    received,
    status,
)
from tests.http.harness import Service, pair, wait_for

POST = "POST /v1/surgeries HTTP/1.1"
KIND = "Content-Type: application/json"


def trickle(connection: socket.socket, data: bytes) -> None:
    """Send a byte now and then until the server answers or closes."""
    end = time.monotonic() + PATIENCE_S
    connection.settimeout(0.2)
    for position in range(len(data)):
        try:
            connection.send(data[position : position + 1])
            if connection.recv(1, socket.MSG_PEEK) is not None:
                break
        except TimeoutError:
            assert time.monotonic() < end, "the server waits for ever"
        except OSError:
            break
    connection.settimeout(PATIENCE_S)


def test_a_head_that_comes_slowly(service: Service) -> None:
    with harmless(service, requests=2), connect(service) as connection:
        trickle(connection, head(service, "GET /v1/health HTTP/1.1", "X-Slow: " + "x" * 2_000))
        assert status(received(connection)) == 408
        assert connection.recv(1) == b""


@pytest.mark.parametrize(
    "headers",
    [
        (KIND, "Content-Length: 2000"),
        (KIND, "Transfer-Encoding: chunked"),
    ],
)
def test_a_body_that_comes_slowly(service: Service, headers: tuple[str, ...]) -> None:
    body = b'{"reference": "' + b"x" * 2_000 if "Content-Length" in headers[1] else b"7D0\r\n" + b" " * 2_000
    with harmless(service, requests=2), connect(service) as connection:
        connection.sendall(head(service, POST, *headers))
        trickle(connection, body)
        assert status(received(connection)) == 408
        assert connection.recv(1) == b""


def test_a_form_that_comes_slowly(service: Service, surgery: str) -> None:
    line = f"POST /v1/surgeries/{surgery}/stages HTTP/1.1"
    with harmless(service, requests=2), connect(service) as connection:
        connection.sendall(
            head(service, line, "Content-Type: multipart/form-data; boundary=x", "Content-Length: 9000")
        )
        trickle(
            connection,
            b'--x\r\nContent-Disposition: form-data; name="left"; filename="l"\r\n\r\n' + b"x" * 2_000,
        )
        assert status(received(connection)) == 408


LARGE = {"chunks": "Transfer-Encoding: chunked", "lengths": "Content-Length: 33554432"}


@pytest.mark.parametrize("length", LARGE.values(), ids=LARGE)
def test_large_uploads_that_come_slowly_do_not_hold_up_those_of_others(
    tmp_path_factory: pytest.TempPathFactory, length: str
) -> None:
    with ExitStack() as opened:
        folder = tmp_path_factory.mktemp("uploads")
        service = opened.enter_context(Service(folder, SPINEWATCH_BODY_TIMEOUT_SECONDS="200"))
        surgery, calibration = service.surgery(), service.calibration()
        line = f"POST /v1/surgeries/{surgery}/stages HTTP/1.1"
        kind = "Content-Type: multipart/form-data; boundary=x"
        slow = [opened.enter_context(connect(service)) for _ in range(4)]  # one is read, the others wait
        for connection in slow:
            connection.sendall(head(service, line, kind, length))
        answers = [service.send(surgery, f"A{number}", pair("PRE"), calibration) for number in range(2)]
        assert [answer.status_code for answer in answers] == [202, 202]
        for connection in slow:
            connection.setblocking(False)
            with pytest.raises(BlockingIOError):  # it has no answer yet
                connection.recv(1)


def test_a_body_that_never_comes_after_its_answer(service: Service) -> None:
    with harmless(service, requests=2), connect(service) as connection:
        connection.sendall(head(service, POST, "Content-Type: text/plain", "Content-Length: 100000"))
        assert status(received(connection)) == 415
        trickle(connection, b"x" * 2_000)
        assert connection.recv(1) == b""


def test_an_upload_without_end_after_its_answer(service: Service) -> None:
    with connect(service) as connection:
        connection.sendall(head(service, POST, "Content-Type: text/plain", "Content-Length: 10000000000"))
        assert status(received(connection)) == 415
        sent = 0
        try:
            while sent < 1_000_000_000:
                sent += connection.send(b"x" * 100_000)
        except OSError:
            pass  # the server has ended the connection
        assert sent < 100_000_000


def test_a_client_that_does_not_read(service: Service, surgery: str) -> None:
    """Its answers fill the buffers; then the server closes, and the other answers are not held in memory."""
    if service.client.get(f"/v1/surgeries/{surgery}/stages/PRE").status_code == 404:
        calibration = service.calibration()
        assert service.send(surgery, "PRE", pair("PRE"), calibration).status_code == 202
    line = head(service, f"GET /v1/surgeries/{surgery}/stages/PRE/images/left HTTP/1.1")
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.connect(("127.0.0.1", service.port))
        connection.settimeout(PATIENCE_S)
        with harmless(service, requests=20):
            connection.sendall(line * 20)
            wait_for(lambda: _closed(connection), "the server to close")


def _closed(connection: socket.socket) -> bool:
    try:
        connection.send(b"\r\n")
    except OSError:
        return True
    return False


@pytest.mark.parametrize(
    "begin", [lambda _: b"", lambda service: head(service, POST)[:-2]], ids=["silent", "half a head"]
)
def test_1100_connections_lock_nobody_out(service: Service, begin: Callable[[Service], bytes]) -> None:
    connections: list[socket.socket] = []
    try:
        for _ in range(1_100):
            connections.append(connect(service))
            connections[-1].sendall(begin(service))
        # the first answer comes when all connections have been accepted
        _answered(service)
        with harmless(service, requests=3):
            for _ in range(3):
                _answered(service)
    finally:
        for connection in connections:
            connection.close()


def test_connections_that_do_not_read_their_answers_lock_nobody_out(service: Service) -> None:
    """Anybody may ask for the files of the pages; most of an answer is not in memory while it is not read."""
    line = (
        f"GET /docs/assets/swagger-ui-bundle.js HTTP/1.1\r\nHost: 127.0.0.1:{service.port}\r\n\r\n".encode()
    )
    connections: list[socket.socket] = []
    forget_peak(service.server.pid)
    try:
        for _ in range(450):
            connection = socket.socket()
            connections.append(connection)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            connection.settimeout(PATIENCE_S)
            connection.connect(("127.0.0.1", service.port))
            connection.sendall(line)
            assert connection.recv(12) == b"HTTP/1.1 200"
        for _ in range(3):
            _answered(service)
        assert peak_memory(service.server.pid) < MAX_MEMORY_BYTES
        assert service.logged("connections_in_use", "127.0.0.1")
    finally:
        for connection in connections:
            connection.close()


def test_streams_of_many_keys_lock_nobody_out(tmp_path_factory: pytest.TempPathFactory) -> None:
    """No key has more than a tenth of all connections, and none of them waits for its client."""
    with (
        Service(tmp_path_factory.mktemp("streams"), SPINEWATCH_MAX_CONNECTIONS="40") as service,
        ExitStack() as opened,
    ):
        service.client.close()
        for _ in range(20):
            key = service.make_key(Scope.STAGE_READ)
            for _ in range(2):
                stream = opened.enter_context(connect(service))
                line = f"GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1:{service.port}\r\n"
                stream.sendall(f"{line}Authorization: Bearer {key}\r\n\r\n".encode())
                assert stream.recv(12) == b"HTTP/1.1 200"
        for _ in range(3):
            _answered(service)


def _answered(service: Service) -> None:
    with connect(service) as another:
        another.sendall(head(service, "GET /v1/health HTTP/1.1"))
        assert status(received(another)) == 200


def test_connections_that_wait_with_half_a_body_make_room_too(service: Service) -> None:
    connections: list[socket.socket] = []
    try:
        for _ in range(450):
            connections.append(connect(service))
            connections[-1].sendall(head(service, POST, KIND, "Content-Length: 100") + b"{")
        with connect(service) as another:
            another.sendall(head(service, "GET /v1/health HTTP/1.1"))
            assert status(received(another)) == 200
    finally:
        for connection in connections:
            connection.close()


def test_tables_that_come_slowly_hold_up_no_other_writer(service: Service) -> None:
    path = f"PUT /v1/surgeries/{service.surgery()}/spine/initial HTTP/1.1"
    with ExitStack() as opened:
        slow = [opened.enter_context(connect(service)) for _ in range(MAX_WRITERS + 1)]
        for each in slow:
            each.sendall(head(service, path, "Content-Type: text/csv", "Content-Length: 100") + b"vertebra,")
        _answered(service)
        service.surgery()
        assert select.select(slow, [], [], 0)[0] == [], "the writer waited until others were refused"


def test_an_idle_connection_is_closed(tmp_path_factory: pytest.TempPathFactory) -> None:
    with (
        Service(tmp_path_factory.mktemp("idle"), SPINEWATCH_IDLE_TIMEOUT_SECONDS="1") as service,
        connect(service) as silent,
        connect(service) as used,
    ):
        used.sendall(head(service, "GET /v1/health HTTP/1.1"))
        assert status(received(used)) == 200
        assert silent.recv(1) == b""
        assert used.recv(1) == b""
