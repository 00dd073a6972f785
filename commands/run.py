"""``spinewatch run``: server and workers under one supervisor."""

from __future__ import annotations

import json
import ssl
import sys
import urllib.request
from http.client import HTTPException
from typing import TYPE_CHECKING, Annotated
from uuid import uuid4

import typer

from commands.shared.address import require_free_port
from commands.shared.configuration import (
    checkpoint,
    load_settings,
    migrate_database,
    require_queue,
    start_log,
)
from commands.shared.exposure import base_url, require_safe_exposure
from commands.shared.key_making import make_first_key
from commands.shared.server_options import BehindProxy, Host, Port, TlsCert, TlsKey

if TYPE_CHECKING:
    from settings import Settings

# Each process has one thread for linear algebra: cores are shared out by the number of workers.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


def run(
    host: Host = None,
    port: Port = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, max=64, help="Number of worker processes.", show_default="SPINEWATCH_WORKERS or 2"
        ),
    ] = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    behind_proxy: BehindProxy = None,
    first_key: Annotated[
        bool, typer.Option(help="On this machine's own address, make an API key when none is valid.")
    ] = True,
) -> None:
    """Migrate the database, start the server and the workers, and restart any that end."""
    from commands.shared.supervisor import Child, Supervisor  # noqa: PLC0415 - --help does not need it

    settings = load_settings(
        host=host,
        port=port,
        workers=workers,
        tls_cert=tls_cert,
        tls_key=tls_key,
        behind_proxy=behind_proxy,
    )
    require_safe_exposure(settings)
    start_log(settings)
    require_free_port(settings.host, settings.port)
    kept = migrate_database(settings)
    if kept is not None:
        typer.echo(f"The database as it was before is kept as {kept}")
    require_queue(settings)
    key = make_first_key(settings) if first_key else None
    if key is not None:
        typer.echo(f"First API key, shown only here: {key}")
    command = [sys.executable, "-P", "-m", "commands"]  # -P: modules never come from the working folder
    children = [Child("serve", [*command, "serve"])]
    children += [Child(f"worker-{n + 1}", [*command, "worker"]) for n in range(settings.workers)]
    settings = settings.model_copy(update={"instance_id": settings.instance_id or uuid4().hex})
    supervisor = Supervisor(children, {**_ONE_THREAD, **settings.environment()}, settings.watchdog_seconds)
    status = supervisor.run(_ReadyMessage(settings, key))
    checkpoint(settings)
    raise typer.Exit(status)


class _ReadyMessage:
    """Prints the address of the service on stdout, once, when the service is ready."""

    def __init__(self, settings: Settings, first_key: str | None) -> None:
        self._url = base_url(settings)
        self._instance = settings.instance_id
        self._first_key = first_key
        unverified = ssl._create_unverified_context()  # noqa: S323 - its own server; no secret is sent
        self._opener = urllib.request.build_opener(
            urllib.request.ProxyHandler({}), urllib.request.HTTPSHandler(context=unverified)
        )
        self._printed = False

    def __call__(self) -> None:
        if self._printed or not self._ready():
            return
        self._printed = True
        typer.echo(f"Spinewatch serves at {self._url} (API documentation: {self._url}/docs)")
        if self._first_key is not None:
            typer.echo(f"Open {self._url}/#key={self._first_key}")
        sys.stdout.flush()

    def _ready(self) -> bool:
        """Return whether the server that this process started answers, and no other one."""
        try:
            with self._opener.open(f"{self._url}/health/live", timeout=1) as response:
                return bool(json.load(response)["instance"] == self._instance)
        except (OSError, ValueError, LookupError, TypeError, HTTPException):
            return False
