"""The server ends in time, whatever its clients do, and takes no more connections than it is told."""

import asyncio
import resource
import signal
import socket
import sqlite3
import threading
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import closing, suppress
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from fastapi.responses import StreamingResponse

from service.server import Server, allow_open_files, make_server
from settings import Settings
from tests.hostile.attack import connect, head
from tests.http.harness import Service, free_port, pair, wait_for
from tests.patience import PATIENCE_S
from tests.sleep import slept_until_exit_s

BAR_S = 3.0
"""Time that the end of the server may wait for others; a busy machine adds to its work alone."""


@pytest.fixture
def running() -> Iterator[tuple[Server, str]]:
    """A server in a thread of this process, with a stream that ends only when the server stops."""
    settings, app = Settings(port=free_port()), FastAPI()
    app.state.stopping = asyncio.Event()

    @app.get("/stream")
    async def stream() -> StreamingResponse:
        async def lines() -> AsyncIterator[bytes]:
            yield b"first\n"
            await app.state.stopping.wait()
            yield b"last\n"

        return StreamingResponse(lines())

    server = make_server(app, settings)
    thread = threading.Thread(target=server.run)
    thread.start()
    wait_for(lambda: server.started, "the server")
    yield server, f"http://127.0.0.1:{settings.port}"
    server.should_exit = True
    thread.join()


def test_a_stream_ends_when_the_server_stops(running: tuple[Server, str]) -> None:
    server, url = running
    with (
        httpx.Client(trust_env=False, timeout=PATIENCE_S) as client,
        client.stream("GET", f"{url}/stream") as response,
    ):
        lines = response.iter_lines()
        assert next(lines) == "first"
        server.should_exit = True
        assert list(lines) == ["last"]


def test_as_many_files_may_be_open_as_the_system_allows() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (256, hard))
        allowed = allow_open_files()
        assert allowed > 256
        assert resource.getrlimit(resource.RLIMIT_NOFILE)[0] == allowed
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.fixture
def clients() -> Iterator[list[socket.socket]]:
    opened: list[socket.socket] = []
    yield opened
    for connection in opened:
        connection.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_within_three_seconds(
    tmp_path: Path, clients: list[socket.socket], number: signal.Signals
) -> None:
    """Silent clients, half a head, half a body, an answer that nobody reads, streams and polls that wait."""
    with Service(tmp_path) as service:
        surgery, calibration = service.surgery(), service.calibration()
        stored = service.send(surgery, "PRE", pair("PRE"), calibration)
        assert stored.status_code == 202
        image = head(service, f"GET /v1/surgeries/{surgery}/stages/PRE/images/left HTTP/1.1")
        form = ("Content-Type: multipart/form-data; boundary=x", "Content-Length: 100000")
        for sent in (
            b"",
            head(service, "GET /v1/health HTTP/1.1")[:-2],
            head(
                service, "POST /v1/surgeries HTTP/1.1", "Content-Type: application/json", "Content-Length: 9"
            ),
            head(service, f"POST /v1/surgeries/{surgery}/stages HTTP/1.1", *form) + b"--x\r\n",
            image * 40,
            head(service, "GET /v1/events HTTP/1.1", "Accept: text/event-stream"),
            head(service, f"GET {stored.headers['Location']}?wait=30 HTTP/1.1"),
        ):
            clients.append(connect(service))
            clients[-1].sendall(sent)
        assert service.ready()
        service.server.send_signal(number)
        assert slept_until_exit_s(service.server.pid) < BAR_S
        assert not service.logged("Traceback")


def test_a_database_held_by_another_does_not_hold_the_end(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        if not service.database_url.startswith("sqlite"):
            pytest.skip("the lock is one of SQLite")
        with closing(sqlite3.connect(service.database, isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            writing = threading.Thread(target=_write, args=(service,))
            writing.start()
            time.sleep(0.5)
            service.server.terminate()
            assert slept_until_exit_s(service.server.pid) < BAR_S
        writing.join()


def _write(service: Service) -> None:
    with suppress(httpx.TransportError, AssertionError):
        service.surgery()
