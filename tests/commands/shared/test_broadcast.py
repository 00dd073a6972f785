"""The broadcast: every client has the present bytes, and one that does not read holds up nobody."""

from __future__ import annotations

import socket
import time

import pytest

from commands.shared.broadcast import AddressError, Broadcast
from tests.patience import PATIENCE_S

PATIENCE_SECONDS = PATIENCE_S


def connected(server: Broadcast) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), PATIENCE_SECONDS)


def taken(client: socket.socket, size: int) -> bytes:
    """Return as many bytes, or fewer if the server disconnects."""
    content, place = memoryview(bytearray(size)), 0
    while place < size:
        count = client.recv_into(content[place:])
        if count == 0:
            break
        place += count
    return bytes(content[:place])


def test_a_new_client_gets_the_present_bytes_and_then_each_new_ones() -> None:
    with Broadcast("127.0.0.1", 0) as server:
        server.send(b"one")
        with connected(server) as first:
            assert taken(first, 3) == b"one"
            server.send(b"three")
            assert taken(first, 5) == b"three"
            with connected(server) as second:
                assert taken(second, 5) == b"three"


def test_a_client_that_does_not_read_is_dropped_and_the_others_are_served() -> None:
    large = bytes(20_000_000)
    with Broadcast("127.0.0.1", 0, patience_s=2.0) as server, connected(server) as idle:
        server.send(large)
        with connected(server) as client:
            assert taken(client, len(large)) == large
        end = time.monotonic() + PATIENCE_SECONDS
        while server.clients:
            assert time.monotonic() < end
            time.sleep(0.05)
        assert len(taken(idle, len(large))) < len(large)


def test_clients_are_limited() -> None:
    with Broadcast("127.0.0.1", 0) as server:
        server.send(b"x")
        clients = [connected(server) for _ in range(33)]
        assert [taken(client, 1) for client in clients] == [b"x"] * 32 + [b""]
        for client in clients:
            client.close()


def test_leaving_disconnects() -> None:
    with Broadcast("127.0.0.1", 0) as server:
        server.send(b"x")
        client = connected(server)
        assert taken(client, 1) == b"x"
    assert client.recv(1) == b""
    client.close()
    with pytest.raises(ConnectionRefusedError):
        connected(server)


@pytest.mark.parametrize("host", ["192.0.2.1", "no such host"])
def test_an_address_of_nobody_is_refused(host: str) -> None:
    with pytest.raises(AddressError, match="choose another --host or --port"):
        Broadcast(host, 0)


@pytest.mark.parametrize("host", ["a" * 300, "a\n\u2028", "\udcff", "a..b"])
def test_what_is_no_address_is_refused(host: str) -> None:
    with pytest.raises(AddressError, match="is no address to listen on"):
        Broadcast(host, 0)
