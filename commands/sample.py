"""``spinewatch sample``: measure the sample surgery over HTTP, as a capture cart does (``make run``)."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from commands.shared.key_option import Key
from spinewatch.errors import SpinewatchError

SAMPLES = Path(__file__).parents[1] / "samples"


class SampleMissingError(SpinewatchError):
    """The sample surgery was not found."""

    code = "sample-missing"


def sample(
    exit_after: Annotated[bool, typer.Option("--exit", help="Stop after the tables.")] = False,
    url: Annotated[
        str | None, typer.Option(help="URL of a running service to use instead of starting one.")
    ] = None,
    data_dir: Annotated[
        Path, typer.Option(help="Folder for the database of the service started here.")
    ] = Path("var"),
    port: Annotated[
        int,
        typer.Option(
            min=1, max=65535, help="Port of the service started here; the next free one if it is in use."
        ),
    ] = 8000,
    key: Key = None,
    samples: Annotated[Path, typer.Option(help="Folder that contains the sample surgery D1.")] = SAMPLES,
) -> None:
    """Measure the stages PRE, INTER and POST of the sample surgery, print the results, and keep serving."""
    folder = samples / "D1"
    if not os.path.exists(folder / "surgery.json"):  # of a name that is too long, Path.exists raises
        raise SampleMissingError(f"no sample surgery in {samples}; name its folder with --samples")
    from commands.shared.api_client import ApiClient  # noqa: PLC0415 - loads httpx and rich, which --help does not need
    from commands.shared.local_service import LocalService  # noqa: PLC0415
    from commands.shared.sample_surgery import measure_surgery  # noqa: PLC0415

    if url is not None:
        with ApiClient(url, key=key) as client:
            raise typer.Exit(0 if measure_surgery(client, folder) else 1)
    signal.signal(
        signal.SIGTERM, lambda *_: sys.exit(0)
    )  # unwinds the stack, so that the service is stopped too
    with LocalService(data_dir, port) as service:
        with ApiClient(service.url, key=service.key) as client:
            succeeded = measure_surgery(client, folder)
        if not exit_after:
            service.serve_until_interrupted()
    raise typer.Exit(0 if succeeded else 1)
