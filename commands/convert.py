"""``spinewatch convert``: a rig from one file format to another."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from commands.shared.files import printable_name, require_ending
from exports.text import single_line
from spinewatch.rig_files import RigFormat

_CART_IMAGE_SIZE = "568x416"
_ENDINGS: Mapping[RigFormat, tuple[str, ...]] = {
    "json": (".json", ""),
    "1995": (".dat", ".1995", ""),
    "opencv": (".yml", ".yaml", ".opencv", ""),
}


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            help="Rig file; for openptv the folder with left.ori, left.addpar, right.ori, right.addpar; for OpenCV also"
            " intrinsics.yml with extrinsics.yml beside it."
        ),
    ],
    out: Annotated[Path, typer.Option(help="File to write the rig to; for openptv an existing folder.")],
    source_format: Annotated[RigFormat, typer.Option("--from", help="Format of the source.")] = "json",
    target_format: Annotated[RigFormat, typer.Option("--to", help="Format to write.")] = "json",
    image_size: Annotated[
        str | None,
        typer.Option(
            help="Image size, px: 640x480; 1995, openptv and OpenCV's intrinsics.yml do not contain it.",
            show_default="568x416, except for intrinsics.yml",
        ),
    ] = None,
    pixel_size: Annotated[
        str | None,
        typer.Option(help="Pixel width and height, mm: 0.01,0.00845.", show_default="the cart's pixels"),
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the rig, for formats without one.")] = "rig",
) -> None:
    """Convert a rig between rig JSON, the parameter file of 1995, OpenCV YAML and OpenPTV."""
    if target_format in _ENDINGS:
        require_ending(out, _ENDINGS[target_format], f"a rig in the format {target_format}")
    from commands.shared.calibration_options import parse_sensor  # noqa: PLC0415 - loads SciPy, which --help does not need
    from commands.shared.rig_files import read_rig_file, write_rig_file  # noqa: PLC0415

    sensor = parse_sensor(_CART_IMAGE_SIZE if image_size is None else image_size, pixel_size)
    size = None if image_size is None else sensor.image_size_px
    content = read_rig_file(source, source_format, printable_name(name), size, sensor.pixel_size_mm)
    write_error = write_rig_file(content.rig, out, target_format)
    for warning in content.warnings:
        typer.echo(single_line(f"warning: {warning}"), err=True)
    rig = content.rig
    typer.echo(
        f"{out}: {rig.name}, baseline {rig.baseline_mm:.1f} mm, vergence {rig.vergence_deg:.2f} degrees;"
        f" maximum error of a fitted distortion model {max(content.fit_error_px, write_error):.4f} px"
    )
