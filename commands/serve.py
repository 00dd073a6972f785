"""``spinewatch serve``: the HTTP API alone."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import typer

from commands.shared.address import require_free_port
from commands.shared.configuration import load_settings, require_database, require_queue, start_log
from commands.shared.exposure import require_safe_exposure
from commands.shared.loading import loading
from commands.shared.server_options import BehindProxy, Host, Port, TlsCert, TlsKey
from commands.shared.watchdog import notifier

if TYPE_CHECKING:
    from service.server import Server
    from settings import Settings


def serve(
    host: Host = None,
    port: Port = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    behind_proxy: BehindProxy = None,
) -> None:
    """Serve the HTTP API; jobs run only while a `spinewatch worker` runs too."""
    with loading():
        server = _server(
            load_settings(host=host, port=port, tls_cert=tls_cert, tls_key=tls_key, behind_proxy=behind_proxy)
        )
    with suppress(KeyboardInterrupt):  # raised again after a graceful shutdown
        server.run()
    if not server.started:
        raise typer.Exit(1)


def _server(settings: Settings) -> Server:
    require_safe_exposure(settings)
    require_database(settings)
    require_queue(settings)
    require_free_port(settings.host, settings.port)
    start_log(settings)
    from service.app import create_app  # noqa: PLC0415 - neither --help nor a failed check needs them
    from service.server import make_server  # noqa: PLC0415

    return make_server(create_app(settings), settings, notifier())
