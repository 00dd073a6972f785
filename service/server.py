"""The HTTP server: uvicorn with limits on connections, and an end within three seconds."""

from __future__ import annotations

import asyncio
import gc
import os
import resource
import socket
import threading
from collections.abc import Callable
from functools import partial
from types import FrameType

import structlog
import uvicorn
from fastapi import FastAPI

from service.connection import ConnectionLimits, LimitedConfig, LimitedConnection
from settings import Settings

_MAX_OPEN_FILES = 65_536
_GRACE_S = 1.0
"""Time in which requests may end after the signal to stop; then their connections are ended."""
_GIVE_UP_S = 2.7
"""Time after the signal to stop at which the process ends, whatever its threads do."""
_TICKS_PER_CHECK = 5
_log = structlog.get_logger("service")


class Server(uvicorn.Server):
    """A server that checks its connections, and that stops its streams before it waits for requests to end."""

    def __init__(self, config: LimitedConfig, app: FastAPI, beat: Callable[[], None] | None = None) -> None:
        super().__init__(config)
        self._app = app
        self._handshake_s = config.limits.header_s
        self._beat = beat

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen; a TLS handshake, which comes before there is a connection to check, has the time of a head."""
        loop = asyncio.get_running_loop()
        if self.config.is_ssl:  # uvicorn has no setting for it
            listen = partial(loop.create_server, ssl_handshake_timeout=self._handshake_s)
            loop.create_server = listen  # type: ignore[method-assign]
        await super().startup(sockets)

    async def on_tick(self, counter: int) -> bool:
        """Check all connections and give a sign of life, twice a second; return whether to stop."""
        if counter % _TICKS_PER_CHECK == 0:
            if self._beat is not None:
                self._beat()
            now = asyncio.get_running_loop().time()
            for connection in list(self.server_state.connections):
                if isinstance(connection, LimitedConnection):
                    _check(connection, now)
        return await super().on_tick(counter)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End the streams, let requests end for a second, then end the connections that are left."""
        self._app.state.stopping.set()
        ending = asyncio.get_running_loop().create_task(self._end_connections())
        await super().shutdown(sockets)
        ending.cancel()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Stop; the process ends in time even if a thread waits for a database."""
        last = threading.Timer(_GIVE_UP_S, os._exit, (128 + sig,))
        last.daemon = True
        last.start()
        super().handle_exit(sig, frame)

    async def _end_connections(self) -> None:
        await asyncio.sleep(_GRACE_S)
        for connection in list(self.server_state.connections):
            if isinstance(connection, LimitedConnection):
                connection.end()


def _check(connection: LimitedConnection, now: float) -> None:
    """End a connection that is late; whatever happens to one, the server and the others go on."""
    try:
        connection.check(now)
    except Exception:
        _log.exception("connection_broke")
        connection.end()


def make_server(app: FastAPI, settings: Settings, beat: Callable[[], None] | None = None) -> Server:
    """Return the server of an application, which calls ``beat`` twice a second from its event loop.

    As many files may then be open as the system allows.
    """
    config = LimitedConfig(
        app,
        host=settings.host,
        port=settings.port,
        http=LimitedConnection,
        ws="none",
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=settings.behind_proxy,
        forwarded_allow_ips=settings.trusted_proxies,
        ssl_certfile=settings.tls_cert,
        ssl_keyfile=settings.tls_key,
        timeout_keep_alive=int(settings.idle_timeout_seconds),
        timeout_graceful_shutdown=2,
    )
    gc.freeze()  # what is loaded stays; a full collection during a request no longer visits it
    config.limits = ConnectionLimits.of(settings, allow_open_files())
    return Server(config, app, beat)


def allow_open_files() -> int:
    """Raise the soft limit of open files to the hard one, and return it; each connection is one."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _MAX_OPEN_FILES if hard == resource.RLIM_INFINITY else min(hard, _MAX_OPEN_FILES)
    if soft == resource.RLIM_INFINITY or soft >= wanted:
        return _MAX_OPEN_FILES if soft == resource.RLIM_INFINITY else soft
    resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return wanted
