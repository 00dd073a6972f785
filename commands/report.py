"""``spinewatch report``: the report of a surgery as HTML or PDF."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from commands.shared.files import require_ending, write_bytes
from commands.shared.key_option import Key


def report(
    out: Annotated[Path, typer.Option(help="File to write; .pdf for a PDF, .html or .htm for HTML.")],
    surgery: Annotated[
        str | None, typer.Argument(help="Identifier of a surgery of a running service.")
    ] = None,
    file: Annotated[
        Path | None, typer.Option(help="Instead: a JSON file of `spinewatch spine`, or with a summary.")
    ] = None,
    url: Annotated[str, typer.Option(help="Address of the service.")] = "http://127.0.0.1:8000",
    key: Key = None,
) -> None:
    """Write the report of a surgery, one file that needs no other."""
    require_ending(out, (".html", ".htm", ".pdf"), "a report")
    from commands.shared.summary_choice import read_summary  # noqa: PLC0415 - --help does not need them
    from reports.pdf import to_pdf  # noqa: PLC0415
    from reports.surgery import render_surgery  # noqa: PLC0415

    page = render_surgery(read_summary(surgery, file, url, key))
    write_bytes(out, to_pdf(page) if out.suffix.lower() == ".pdf" else page.encode())
