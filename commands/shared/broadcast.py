"""A TCP server that sends the same bytes to every client: the present ones to a new client, new ones to all."""

from __future__ import annotations

import os
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType

from spinewatch.errors import SpinewatchError

_SEND_TIMEOUT_SECONDS = 5.0
_PAUSE_SECONDS = 0.1
_CLIENTS = 32
_DRAIN_BYTES = 65536


class AddressError(SpinewatchError):
    """The address to listen on is in use or not of this machine."""

    code = "address"


class Broadcast:
    """The server; a context manager that accepts clients in threads of its own until it is left.

    What clients send is read and ignored. A client that does not take its bytes in time, or one too many, is
    disconnected and does not keep the others waiting.
    """

    def __init__(self, host: str, port: int, patience_s: float = _SEND_TIMEOUT_SECONDS) -> None:
        try:
            self._listener = socket.create_server((host, port), family=_family(host, port))
        except OSError as error:
            raise AddressError(
                f"cannot listen on {host} port {port}: {_reason(error)}; choose another --host or --port"
            ) from error
        except (UnicodeError, TypeError) as error:  # TypeError: of bytes that are no text
            raise AddressError(f"{host!r} is no address to listen on; choose another with --host") from error
        self._patience_s = patience_s
        self.port: int = self._listener.getsockname()[1]
        self._left = threading.Event()
        self._present = b""
        self._clients: set[_Client] = set()
        self._lock = threading.Lock()

    def __enter__(self) -> Broadcast:
        threading.Thread(target=self._accept, daemon=True, name="accept").start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._left.set()
        _close(self._listener)
        with self._lock:
            clients, self._clients = self._clients, set()
        for client in clients:
            client.close()

    @property
    def clients(self) -> int:
        """Number of clients that are connected."""
        with self._lock:
            return len(self._clients)

    def send(self, content: bytes) -> None:
        """Send bytes to every client, and to each that comes until the next call."""
        with self._lock:
            self._present = content
            clients = list(self._clients)
        for client in clients:
            client.offer(content)

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                if self._left.wait(_PAUSE_SECONDS):
                    return
                continue  # out of file descriptors, or a client that gave up
            with self._lock:
                if len(self._clients) >= _CLIENTS:
                    _close(connection)
                    continue
                client = _Client(connection, self._patience_s, self._forget)
                self._clients.add(client)
                client.offer(self._present)
            client.start()

    def _forget(self, client: _Client) -> None:
        with self._lock:
            self._clients.discard(client)


class _Client:
    """One connection: a thread that sends the latest bytes on offer, and one that reads what comes in."""

    def __init__(
        self, connection: socket.socket, patience_s: float, forget: Callable[[_Client], None]
    ) -> None:
        self._connection = connection
        self._connection.settimeout(patience_s)
        self._forget = forget
        self._offer = b""
        self._wake = threading.Event()
        self._closed = False

    def start(self) -> None:
        for target in (self._send, self._drain):
            threading.Thread(target=target, daemon=True, name="client").start()

    def offer(self, content: bytes) -> None:
        self._offer = content
        self._wake.set()

    def close(self) -> None:
        self._closed = True
        self._wake.set()
        _close(self._connection)

    def _send(self) -> None:
        try:
            while True:
                self._wake.wait()
                self._wake.clear()
                if self._closed:
                    return
                self._connection.sendall(self._offer)
        except OSError:
            return  # gone, or too slow
        finally:
            self._forget(self)
            self.close()

    def _drain(self) -> None:
        try:
            while not self._closed:
                try:
                    if not self._connection.recv(_DRAIN_BYTES):
                        return
                except TimeoutError:
                    continue
        except OSError:
            return
        finally:
            self._forget(self)
            self.close()


def _family(host: str, port: int) -> socket.AddressFamily:
    return socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]


def _reason(error: OSError) -> str:
    if isinstance(error, socket.gaierror) or not error.errno:
        return error.strerror or str(error)
    return os.strerror(error.errno)


def _close(connection: socket.socket) -> None:
    """Close a socket so that a thread that waits for it wakes up."""
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)
    connection.close()
