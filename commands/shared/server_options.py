"""Options of the commands that start the HTTP server."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Host = Annotated[
    str | None, typer.Option(help="Address to listen on.", show_default="SPINEWATCH_HOST or 127.0.0.1")
]
Port = Annotated[
    int | None,
    typer.Option(min=1, max=65535, help="Port to listen on.", show_default="SPINEWATCH_PORT or 8000"),
]
TlsCert = Annotated[
    Path | None, typer.Option(help="TLS certificate, PEM.", show_default="SPINEWATCH_TLS_CERT or none")
]
TlsKey = Annotated[
    Path | None,
    typer.Option(help="Private key of the certificate, PEM.", show_default="SPINEWATCH_TLS_KEY or none"),
]
BehindProxy = Annotated[
    bool | None,
    typer.Option(
        "--behind-proxy/--no-proxy",
        help="A proxy that ends TLS forwards to this service.",
        show_default="SPINEWATCH_BEHIND_PROXY or not",
    ),
]
