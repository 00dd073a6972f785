"""``spinewatch pix2mm``: pixels to plate coordinates, the PIX2MM of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def pix2mm(
    features: Annotated[Path, typer.Argument(help="List of pixels, such as FEATURES.DAT: number u v.")],
    image_size: Annotated[str, typer.Option(help="Image size, px.")] = "568x416",
    pixel_size: Annotated[
        str | None,
        typer.Option(help="Pixel width and height, mm: 0.01,0.00845.", show_default="the cart's pixels"),
    ] = None,
) -> None:
    """Print plate coordinates, mm: origin at the centre of the image, x right, y up (thesis section 3.3, eq. 3.5)."""
    from commands.programs_1995.inputs import read_feature_list  # noqa: PLC0415 - loads SciPy
    from commands.shared.calibration_options import parse_sensor  # noqa: PLC0415

    sensor = parse_sensor(image_size, pixel_size)
    pixels = read_feature_list(features).xy_px
    (width, height), (px, py) = sensor.image_size_px, sensor.pixel_size_mm
    x_mm, y_mm = (pixels[:, 0] - (width - 1) / 2) * px, ((height - 1) / 2 - pixels[:, 1]) * py
    typer.echo("# number x_mm y_mm")
    for number, (x, y) in enumerate(zip(x_mm, y_mm, strict=True), 1):
        typer.echo(f"{number} {x:.6f} {y:.6f}")
