"""``spinewatch serve``: the HTTP API alone."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated

import typer

from commands.shared.configuration import load_settings, require_database, require_queue, start_log


def serve(
    host: Annotated[
        str | None, typer.Option(help="Address to listen on.", show_default="SPINEWATCH_HOST or 127.0.0.1")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="Port to listen on.", show_default="SPINEWATCH_PORT or 8000")
    ] = None,
) -> None:
    """Serve the HTTP API; jobs run only while a `spinewatch worker` runs too."""
    settings = load_settings(host=host, port=port)
    require_database(settings)
    require_queue(settings)
    start_log(settings)
    import uvicorn  # noqa: PLC0415 - neither --help nor a failed check needs it

    from service.app import create_app  # noqa: PLC0415

    server = uvicorn.Server(
        uvicorn.Config(
            create_app(settings),
            host=settings.host,
            port=settings.port,
            log_config=None,
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=3,
        )
    )
    with suppress(KeyboardInterrupt):  # raised again after a graceful shutdown
        server.run()
    if not server.started:
        raise typer.Exit(1)
