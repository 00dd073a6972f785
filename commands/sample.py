"""``spinewatch sample``: the sample surgery measured over HTTP as a capture cart would (``make run``)."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from spinewatch.errors import SpinewatchError

SAMPLES = Path(__file__).parents[1] / "samples"


class SampleMissingError(SpinewatchError):
    """The sample surgery is not where it should be."""

    code = "sample-missing"


def sample(
    exit_after: Annotated[bool, typer.Option("--exit", help="Stop after the tables.")] = False,
    url: Annotated[str | None, typer.Option(help="Use this running service instead of starting one.")] = None,
    data_dir: Annotated[Path, typer.Option(help="Folder of the record, of a service started here.")] = Path(
        "var"
    ),
    port: Annotated[
        int, typer.Option(help="Port of a service started here; the next free one if taken.")
    ] = 8000,
    samples: Annotated[Path, typer.Option(help="Folder that holds the sample surgery D1.")] = SAMPLES,
) -> None:
    """Measure the sample surgery PRE, INTER, POST over HTTP, print what moved, and keep serving."""
    folder = samples / "D1"
    if not (folder / "surgery.json").exists():
        raise SampleMissingError(f"no sample surgery in {samples}; name its folder with --samples")
    from commands.shared.api_client import ApiClient  # noqa: PLC0415 - HTTP and tables, which --help can do without
    from commands.shared.local_service import LocalService  # noqa: PLC0415
    from commands.shared.sample_surgery import measure_surgery  # noqa: PLC0415

    if url is not None:
        with ApiClient(url) as cart:
            raise typer.Exit(0 if measure_surgery(cart, folder) else 1)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))  # unwinds, so that the service is stopped too
    with LocalService(data_dir, port) as service:
        with ApiClient(service.url) as cart:
            succeeded = measure_surgery(cart, folder)
        if not exit_after:
            service.serve_until_interrupted()
    raise typer.Exit(0 if succeeded else 1)
