"""``spinewatch convert``: a rig from one file format to another."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer


def convert(
    source: Annotated[
        Path, typer.Argument(help="The rig; for openptv a folder with left.ori, left.addpar, right.ori ...")
    ],
    out: Annotated[Path, typer.Option(help="Write the rig here; for openptv a folder that exists.")],
    source_format: Annotated[
        Literal["json", "1995", "opencv", "openptv"], typer.Option("--from", help="Format of the source.")
    ] = "json",
    target_format: Annotated[
        Literal["json", "1995", "opencv", "openptv"], typer.Option("--to", help="Format to write.")
    ] = "json",
    image_size: Annotated[
        str, typer.Option(help="Image size, which 1995 and openptv do not tell.")
    ] = "568x416",
    pixel_size: Annotated[
        str | None, typer.Option(help="Pixel width and height in mm: 0.01,0.00845. The cart's by default.")
    ] = None,
    name: Annotated[str, typer.Option(help="Name of a rig that comes without one.")] = "rig",
) -> None:
    """Write a rig in another format: ours (json), the form of 1995, OpenCV's or OpenPTV's."""
    from commands.shared.calibration import sensor_of  # noqa: PLC0415 - loads OpenCV, which --help can do without
    from commands.shared.rig_files import read_rig_file, write_rig_file  # noqa: PLC0415

    rig, read_error = read_rig_file(source, source_format, sensor_of(image_size, pixel_size), name)
    write_error = write_rig_file(rig, out, target_format)
    typer.echo(
        f"{out}: {rig.name}, baseline {rig.baseline_mm:.1f} mm, vergence {rig.vergence_deg:.2f} degrees;"
        f" distortion fitted to {max(read_error, write_error):.4f} px"
    )
