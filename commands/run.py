"""``spinewatch run``: server and workers under one supervisor."""

from __future__ import annotations

import socket
import sys
import urllib.request
from typing import TYPE_CHECKING, Annotated

import typer

from commands.shared.configuration import load_settings, migrate_database, start_log
from spinewatch.errors import SpinewatchError

if TYPE_CHECKING:
    from settings import Settings

# Each process has one thread for linear algebra: cores are shared out by the number of workers.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


class PortTakenError(SpinewatchError):
    """The address of the service cannot be bound."""

    code = "port-taken"


def run(
    host: Annotated[
        str | None, typer.Option(help="Address to listen on.", show_default="SPINEWATCH_HOST or 127.0.0.1")
    ] = None,
    port: Annotated[
        int | None, typer.Option(help="Port to listen on.", show_default="SPINEWATCH_PORT or 8000")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Number of worker processes.", show_default="SPINEWATCH_WORKERS or 2")
    ] = None,
) -> None:
    """Migrate the database, start the server and the workers, and restart any that end."""
    from commands.shared.supervisor import Child, Supervisor  # noqa: PLC0415 - --help does not need it

    settings = load_settings(host=host, port=port, workers=workers)
    start_log(settings)
    require_free_port(settings.host, settings.port)
    migrate_database(settings)
    command = [sys.executable, "-m", "commands"]
    children = [Child("serve", [*command, "serve"])]
    children += [Child(f"worker-{n + 1}", [*command, "worker"]) for n in range(settings.workers)]
    supervisor = Supervisor(children, {**_ONE_THREAD, **settings.environment()})
    raise typer.Exit(supervisor.run(_ReadyMessage(settings)))


def require_free_port(host: str, port: int) -> None:
    """Raise ``PortTakenError`` unless a server can listen on this address."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise PortTakenError(
                f"cannot listen on {host} port {port}: {error.strerror}; choose another with --port"
            ) from error


class _ReadyMessage:
    """Prints the address of the service on stdout, once, when the service is ready."""

    def __init__(self, settings: Settings) -> None:
        host = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(settings.host, settings.host)  # noqa: S104
        self._url = f"http://{host}:{settings.port}"
        self._opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        self._printed = False

    def __call__(self) -> None:
        if self._printed or not self._ready():
            return
        self._printed = True
        typer.echo(f"Spinewatch serves at {self._url} (API documentation: {self._url}/docs)")
        sys.stdout.flush()

    def _ready(self) -> bool:
        try:
            with self._opener.open(f"{self._url}/v1/health", timeout=1) as response:
                return bool(response.status == 200)
        except OSError:
            return False
