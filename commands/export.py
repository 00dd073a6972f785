"""``spinewatch export``: a surgery in a format of other software."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from commands.shared.files import write_bytes
from commands.shared.key_option import Key


def export(
    format: Annotated[
        str,
        typer.Argument(
            help="slicer-markups, slicer-transforms, gltf, csv, json, fhir or dicom-sr.", metavar="FORMAT"
        ),
    ],
    surgery: Annotated[
        str | None, typer.Argument(help="Identifier of a surgery of a running service.")
    ] = None,
    file: Annotated[
        Path | None, typer.Option(help="Instead: a JSON file of `spinewatch spine`, or with a summary.")
    ] = None,
    url: Annotated[str, typer.Option(help="Address of the service.")] = "http://127.0.0.1:8000",
    key: Key = None,
    stage: Annotated[str | None, typer.Option(help="One stage alone, for the formats that allow it.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File to write; - for standard output.", show_default="case and format"),
    ] = None,
) -> None:
    """Write a surgery for 3D Slicer, as glTF, CSV, JSON, FHIR or DICOM SR."""
    from commands.shared.summary_choice import read_summary  # noqa: PLC0415 - --help does not need them
    from exports.formats import export_surgery  # noqa: PLC0415

    made = export_surgery(read_summary(surgery, file, url, key), format, stage)
    if out == Path("-"):
        sys.stdout.buffer.write(made.content)
        return
    path = out or Path(made.file_name)
    write_bytes(path, made.content)
    sys.stdout.write(f"{path}\n")
