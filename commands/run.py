"""``spinewatch run``: everything, supervised."""

from __future__ import annotations

import socket
import sys
import urllib.error
import urllib.request
from typing import TYPE_CHECKING, Annotated

import typer

from commands.shared.configuration import load_settings, start_log
from spinewatch.errors import SpinewatchError

if TYPE_CHECKING:
    from settings import Settings

_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


class PortTakenError(SpinewatchError):
    """Another program listens where the service should."""

    code = "port-taken"


def run(
    host: Annotated[str | None, typer.Option(help="Address to listen on.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on.")] = None,
    workers: Annotated[int | None, typer.Option(help="How many worker processes.")] = None,
) -> None:
    """Bring the database up to date, then serve and measure; whatever dies is started again."""
    from commands.shared.supervisor import Child, Supervisor  # noqa: PLC0415 - --help can do without
    from migrations.history import upgrade  # noqa: PLC0415

    settings = load_settings(host=host, port=port, workers=workers)
    start_log(settings)
    require_free_port(settings.host, settings.port)
    upgrade(settings.database_url)
    command = [sys.executable, "-m", "commands"]
    children = [Child("serve", [*command, "serve"])]
    children += [Child(f"worker-{n + 1}", [*command, "worker"]) for n in range(settings.workers)]
    supervisor = Supervisor(children, {**_ONE_THREAD, **settings.environment()})
    raise typer.Exit(supervisor.run(_Announcement(settings)))


class _Announcement:
    """Says once, on stdout, that the service is ready and where."""

    def __init__(self, settings: Settings) -> None:
        host = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(settings.host, settings.host)  # noqa: S104
        self._url = f"http://{host}:{settings.port}"
        self._made = False

    def __call__(self) -> None:
        if self._made or not self._ready():
            return
        self._made = True
        typer.echo(f"Spinewatch serves at {self._url} (API pages: {self._url}/docs)")
        sys.stdout.flush()

    def _ready(self) -> bool:
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(f"{self._url}/v1/health", timeout=1) as answer:
                return bool(answer.status == 200)
        except OSError:
            return False


def require_free_port(host: str, port: int) -> None:
    """Raise ``PortTakenError`` when nothing can listen there."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            raise PortTakenError(
                f"cannot listen on {host} port {port}: {error.strerror}; choose another with --port"
            ) from error
