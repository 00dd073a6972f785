"""One client's connection: uvicorn's protocol with time limits, and with problems instead of plain text."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any, cast

import h11
import structlog
from uvicorn import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.utils import get_remote_addr
from uvicorn.server import ServerState

from service.access import PRINCIPAL, Principal
from service.failed_attempts import network_of
from service.http_head import StrictConnection
from service.problems import MEDIA_TYPE, problem
from settings import Settings

_LINGER_S = 2.0
"""Time in which a client may still read a refusal while what it sends is discarded."""
_LINGER_BYTES = 2**20
"""What is discarded in that time, beyond ``discard_bytes``."""
_MIN_READ_RATE = 1024
"""Bytes per second that a client reads at least."""
_MAX_SHARE = 0.1
"""Share of all connections; a key, or an address without one, that has more is the first to lose one."""
_log = structlog.get_logger("service")


@dataclass(frozen=True)
class ConnectionLimits:
    """Limits of all connections of a server, seconds and bytes."""

    max_connections: int
    header_s: float
    body_s: float
    idle_s: float
    write_s: float
    discard_bytes: int

    @classmethod
    def of(cls, settings: Settings, open_files: int) -> ConnectionLimits:
        """Return the limits of the settings; a quarter of the files that may be open is kept for other uses."""
        return cls(
            max_connections=min(settings.max_connections, open_files * 3 // 4),
            header_s=settings.header_timeout_seconds,
            body_s=settings.body_timeout_seconds,
            idle_s=settings.idle_timeout_seconds,
            write_s=settings.write_timeout_seconds,
            discard_bytes=settings.max_upload_bytes,
        )


class LimitedConfig(Config):
    """uvicorn's configuration with the limits of connections."""

    limits: ConnectionLimits


class _LingeringTransport:
    """A transport whose ``close`` does nothing while the connection lingers."""

    def __init__(self, transport: asyncio.Transport, lingers: Callable[[], bool]) -> None:
        self._transport, self._lingers = transport, lingers

    def close(self) -> None:
        if not self._lingers():
            self._transport.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)


class LimitedConnection(H11Protocol):
    """A connection that ends when its client is too slow, and makes room for others while it waits for its client.

    ``check`` is called about once a second; it ends what is late.
    """

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self.conn: StrictConnection = StrictConnection()
        self._limits = cast("LimitedConfig", config).limits
        self._waiting_since = self.loop.time()
        self._head_since: float | None = None
        self._answered_since: float | None = None
        self._ended_since: float | None = None
        self._discarded = 0
        self._last_owner = ""
        self._unread = (0, self._waiting_since)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take the connection, and end another if there are too many."""
        address = get_remote_addr(transport)
        self._last_owner = network_of("" if address is None else address[0])
        full = len(self.connections) >= self._limits.max_connections
        if full:
            ended = self._makes_room()
            _log.warning("connections_in_use", ended_of=None if ended is None else ended.owner)
            if ended is not None:
                ended.end()
                full = False
        super().connection_made(transport)
        self.transport = cast("asyncio.Transport", _LingeringTransport(transport, self._lingers))
        if full:
            self.refuse(503, "all connections are in use; try again")

    def _makes_room(self) -> LimitedConnection | None:
        """Return the connection to end: of the client with most, if it has more than its share, or of any that waits.

        The one that has waited longest for its client goes first. If the client with most waits for answers alone, its
        latest request does; also when it has no more than its share and all others wait for answers, so that any number
        of streams leaves room for a new client.
        """
        others = [other for other in self.connections if isinstance(other, LimitedConnection)]
        connections = Counter(other.owner for other in others)
        owner, count = max(connections.items(), key=lambda item: item[1])
        waiting = [other for other in others if other.waits_for_client]
        if count > 1 and (count > _MAX_SHARE * self._limits.max_connections or not waiting):
            return min((other for other in others if other.owner == owner), key=LimitedConnection._rank)
        return min(waiting, key=LimitedConnection._rank, default=None)

    def _rank(self) -> tuple[bool, bool, float]:
        """Return what is less for a connection that is to end before another of the same client."""
        waits = self.waits_for_client
        return not waits, self._sends_body, self._waiting_since if waits else -self._waiting_since

    @property
    def owner(self) -> str:
        """Who has the connection: the prefix of the key of its last request, without one the client's address."""
        principal: Principal | None = None if self.scope is None else self.scope["state"].get(PRINCIPAL)
        return self._last_owner if principal is None else principal.prefix

    @property
    def is_idle(self) -> bool:
        """Whether no request is being answered and none is arriving."""
        return self.cycle is None or self.cycle.response_complete

    @property
    def waits_for_client(self) -> bool:
        """Whether the next step is the client's: to send a request or the rest of its body, or to read."""
        return self.is_idle or self._sends_body or self.flow.write_paused

    @property
    def _sends_body(self) -> bool:
        """Whether the rest of the body of a request is awaited."""
        return not self.is_idle and self.cycle.more_body and not self.cycle.response_started

    def data_received(self, data: bytes) -> None:
        """Read what arrived; after a refusal it is discarded."""
        self._waiting_since = self.loop.time()
        if self._ended_since is not None:
            self._discarded += len(data)
            if self._discarded > self._limits.discard_bytes + _LINGER_BYTES:
                self.end()
            return
        if self.is_idle and self.conn.their_state is h11.SEND_BODY:
            self._discarded += len(data)
            if self._discarded > self._limits.discard_bytes:
                self._ended_since = self._waiting_since
                if not self._end_output():
                    self.end()
                return
        elif self.is_idle and self._head_since is None:
            self._head_since, self._discarded = self._waiting_since, 0
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._head_since = None

    def handle_events(self) -> None:
        """Act on what was read, unless the connection has been refused."""
        if self._ended_since is None:
            self._last_owner = self.owner  # a new request has another scope
            super().handle_events()

    def send_400_response(self, msg: str) -> None:
        """Answer a request that is not HTTP."""
        self.refuse(*(self.conn.refused or (400, msg)))

    def _unsupported_upgrade_warning(self) -> None:
        """Answer the request as if it asked for no other protocol (RFC 9110, 7.8)."""

    def refuse(self, status: int, detail: str) -> None:
        """Answer with a problem, if nothing was answered yet, and end the connection."""
        self._unset_keepalive_if_required()
        self._ended_since = self.loop.time()
        if not self.is_idle:
            started = self.cycle.response_started
            self.cycle.disconnected = True
            self.cycle.message_event.set()
            if started:
                self.end()
                return
        body = json.dumps(problem(status, detail).members()).encode()
        headers = [
            *self.server_state.default_headers,
            (b"content-type", MEDIA_TYPE.encode()),
            (b"content-length", str(len(body)).encode()),
            (b"connection", b"close"),
            *([(b"retry-after", b"1")] if status == HTTPStatus.SERVICE_UNAVAILABLE else []),
        ]
        events = (h11.Response(status_code=status, headers=headers), h11.Data(data=body), h11.EndOfMessage())
        try:
            answer = b"".join(self.conn.send(event) or b"" for event in events)
        except h11.LocalProtocolError:
            self.end()
            return
        self.transport.write(answer)
        if not self._end_output():
            self.transport.close()

    def _lingers(self) -> bool:
        """Return whether the connection stays open for a while, since its request was answered before its body came."""
        if self._ended_since is not None or self.conn.their_state is not h11.SEND_BODY:
            return False
        self._ended_since = self.loop.time()
        return self._end_output()

    def _end_output(self) -> bool:
        """End the output alone, for a close while the client still sends could take the answer from it.

        Return whether that is possible.
        """
        if not self.transport.can_write_eof():
            return False
        try:
            self.transport.write_eof()
        except OSError:  # the client has closed already
            self.end()
        return True

    def end(self) -> None:
        """End the connection at once."""
        self.connections.discard(self)
        self.transport.abort()

    def shutdown(self) -> None:
        """Close the connection, or let its request end first."""
        try:
            super().shutdown()
        except h11.LocalProtocolError:
            self.end()

    def check(self, now: float) -> None:
        """End the connection if its client is late."""
        limits = self._limits
        if self._ended_since is not None:
            if now - self._ended_since > _LINGER_S:
                self.end()
        elif self._reads_too_slowly(now):
            self.end()
        elif self.transport.is_closing():  # what is written is still being read
            return
        elif not self.is_idle:
            self._answered_since = None
        elif self.conn.their_state is h11.SEND_BODY:  # answered before the body had arrived
            self._answered_since = now if self._answered_since is None else self._answered_since
            if now - self._answered_since > limits.body_s:
                self.end()
        elif self._head_since is not None:
            if now - self._head_since > limits.header_s:
                self.refuse(408, "the request did not arrive in time; send it again")
        elif now - self._waiting_since > limits.idle_s:
            self.transport.close()

    def _reads_too_slowly(self, now: float) -> bool:
        """Return whether the client has left an answer unread for too long."""
        size, since = self.transport.get_write_buffer_size(), self._unread[1]
        if size == 0 or size > self._unread[0] or self._unread[0] - size > _MIN_READ_RATE * (now - since + 1):
            self._unread = (size, now)
            self._waiting_since = max(self._waiting_since, now) if size else self._waiting_since
            return False
        return now - since > self._limits.write_s
