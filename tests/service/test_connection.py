import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import pytest
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.server import ServerState

from service.connection import ConnectionLimits, LimitedConfig, LimitedConnection
from settings import Settings

LIMITS = replace(ConnectionLimits.of(Settings(), 10_000), max_connections=2)
LATER = 1_000.0
HEAD = b"GET / HTTP/1.1\r\nHost: x\r\n"


class Listener:
    """A listening socket with its connections, which are checked by the tests alone."""

    def __init__(self, address: tuple[str, int], connections: set[Any]) -> None:
        self._address, self.connections = address, connections

    async def client(self, sent: bytes, source: str = "127.0.0.1") -> tuple[socket.socket, LimitedConnection]:
        """Return a client of some address that has sent something, and the server's side of it."""
        known = set(self.connections)
        client = socket.create_connection(self._address, timeout=20, source_address=(source, 0))
        client.sendall(sent)
        client.setblocking(False)
        while True:
            new = [one for one in self.connections if one not in known]
            if new and (not sent or new[0]._head_since is not None or not new[0].is_idle):
                return client, new[0]
            await asyncio.sleep(0.001)


async def everything(client: socket.socket) -> bytes:
    """Return what arrives until the server closes."""
    loop, answer = asyncio.get_running_loop(), b""
    try:
        while data := await loop.sock_recv(client, 65536):
            answer += data
    except ConnectionResetError:
        pass
    return answer


async def waits_for_ever(scope: Scope, receive: Receive, send: Send) -> None:
    await asyncio.Event().wait()


@asynccontextmanager
async def listening(
    limits: ConnectionLimits = LIMITS, app: ASGIApp = waits_for_ever
) -> AsyncIterator[Listener]:
    state = ServerState()
    config = LimitedConfig(app, log_config=None, access_log=False)
    config.limits = limits
    config.load()
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: LimitedConnection(config, state, {}), "127.0.0.1", 0)
    yield Listener(server.sockets[0].getsockname(), state.connections)
    server.close()
    for connection in list(state.connections):
        connection.transport.abort()
    for task in state.tasks:
        task.cancel()
    await asyncio.sleep(0)


def run(scenario: Callable[[], Awaitable[None]]) -> None:
    async def limited() -> None:
        async with asyncio.timeout(30):
            await scenario()

    asyncio.run(limited())


def test_a_late_head_is_answered_with_408() -> None:
    async def scenario() -> None:
        async with listening() as listener:
            client, connection = await listener.client(HEAD)
            now = asyncio.get_running_loop().time()
            connection.check(now + LIMITS.header_s - 1)
            assert not connection.transport.is_closing()
            connection.check(now + LATER)
            connection.check(now + 2 * LATER)
            assert (await everything(client)).startswith(b"HTTP/1.1 408 ")
            client.close()

    run(scenario)


def test_an_answer_before_the_body_reaches_a_client_that_still_sends() -> None:
    async def scenario() -> None:
        connected = asyncio.Event()

        async def refuses_the_body(scope: Scope, receive: Receive, send: Send) -> None:
            await connected.wait()
            headers = [(b"content-length", b"2"), (b"connection", b"close")]
            await send({"type": "http.response.start", "status": 408, "headers": headers})
            await send({"type": "http.response.body", "body": b"no"})

        async with listening(app=refuses_the_body) as listener:
            client, connection = await listener.client(HEAD + b"Content-Length: 100\r\n\r\n")
            connected.set()
            with client:
                while connection.cycle is None or not connection.cycle.response_complete:
                    await asyncio.sleep(0.001)
                loop = asyncio.get_running_loop()
                for _ in range(5):  # a closed connection would answer the first of these with a reset
                    await loop.sock_sendall(client, b"x")
                    await asyncio.sleep(0.01)
                assert (await loop.sock_recv(client, 65536)).endswith(b"no")
                assert await loop.sock_recv(client, 1) == b""
                connection.check(connection.loop.time() + LATER)
                assert connection.transport.is_closing()

    run(scenario)


def test_a_client_that_has_just_gone_does_no_harm() -> None:
    async def scenario() -> None:
        async with listening() as listener:
            client, connection = await listener.client(HEAD)
            client.close()
            connection.check(asyncio.get_running_loop().time() + LATER)

    run(scenario)


def test_a_silent_connection_is_closed() -> None:
    async def scenario() -> None:
        async with listening() as listener:
            client, connection = await listener.client(b"")
            connection.check(asyncio.get_running_loop().time() + LATER)
            assert await everything(client) == b""
            client.close()

    run(scenario)


def test_a_request_that_is_being_answered_is_left_alone() -> None:
    async def scenario() -> None:
        async with listening() as listener:
            client, connection = await listener.client(HEAD + b"\r\n")
            connection.check(asyncio.get_running_loop().time() + LATER)
            assert not connection.transport.is_closing()
            client.close()

    run(scenario)


def test_the_connection_that_has_waited_longest_makes_room() -> None:
    async def scenario() -> None:
        async with listening() as listener:
            first, _ = await listener.client(b"")
            second, _ = await listener.client(b"")
            third, connection = await listener.client(b"")
            assert await everything(first) == b""
            assert not connection.transport.is_closing()
            for client in (first, second, third):
                client.close()

    run(scenario)


def test_one_too_many_is_refused_while_all_others_are_answered() -> None:
    async def scenario() -> None:
        async with listening() as listener:
            busy = [(await listener.client(HEAD + b"\r\n", f"127.0.0.{n + 2}"))[0] for n in range(2)]
            refused, connection = await listener.client(b"")
            connection.check(asyncio.get_running_loop().time() + LATER)
            answer = await everything(refused)
            assert answer.startswith(b"HTTP/1.1 503 ")
            assert b"retry-after: 1" in answer
            for client in (*busy, refused):
                client.close()

    run(scenario)


def test_the_client_with_most_requests_loses_its_latest_when_none_waits() -> None:
    async def scenario() -> None:
        async with listening(replace(LIMITS, max_connections=3)) as listener:
            kept, _ = await listener.client(HEAD + b"\r\n", "127.0.0.2")
            first, older = await listener.client(HEAD + b"\r\n", "127.0.0.3")
            latest, _ = await listener.client(HEAD + b"\r\n", "127.0.0.3")
            new, connection = await listener.client(b"", "127.0.0.4")
            assert await everything(latest) == b""
            assert not older.transport.is_closing()
            assert not connection.transport.is_closing()
            for client in (kept, first, latest, new):
                client.close()

    run(scenario)


def test_clients_with_few_requests_each_leave_room_for_another() -> None:
    async def scenario() -> None:
        async with listening(replace(LIMITS, max_connections=40)) as listener:
            sources = [f"127.0.0.{number + 2}" for number in range(20) for _ in range(2)]
            busy = [(await listener.client(HEAD + b"\r\n", source))[0] for source in sources]
            new, connection = await listener.client(b"", "127.0.0.99")
            assert len(listener.connections) == 40  # one of them has ended
            assert not connection.transport.is_closing()
            for client in (*busy, new):
                client.close()

    run(scenario)


def test_a_client_with_few_connections_keeps_an_idle_one() -> None:
    async def scenario() -> None:
        async with listening(replace(LIMITS, max_connections=3)) as listener:
            kept, connection = await listener.client(b"", "127.0.0.2")
            many = [(await listener.client(HEAD + b"\r\n", "127.0.0.3"))[0] for _ in range(3)]
            assert await everything(many[1]) == b""
            assert not connection.transport.is_closing()
            for client in (kept, *many):
                client.close()

    run(scenario)


def test_a_client_that_does_not_read_makes_room() -> None:
    async def answers_at_length(scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        for _ in range(1_000):
            await send({"type": "http.response.body", "body": bytes(2**16), "more_body": True})

    async def scenario() -> None:
        async with listening(app=answers_at_length) as listener:
            clients = []
            for number in (2, 3):
                client, unread = await listener.client(HEAD + b"\r\n", f"127.0.0.{number}")
                clients.append(client)
                while not unread.waits_for_client:
                    await asyncio.sleep(0.001)
            new, connection = await listener.client(b"", "127.0.0.4")
            assert len(listener.connections) == 2
            assert not connection.transport.is_closing()
            for client in (*clients, new):
                client.close()

    run(scenario)


@pytest.mark.parametrize(("files", "expected"), [(10_000, 1_000), (400, 300)])
def test_files_are_kept_for_other_uses(files: int, expected: int) -> None:
    assert ConnectionLimits.of(Settings(), files).max_connections == expected
