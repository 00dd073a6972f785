"""``spinewatch v2stereo``: camera parameters by collinearity, the V2STEREO of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def v2stereo(
    left: Annotated[Path, typer.Argument(help="CSV of image points of the left camera.")],
    right: Annotated[Path, typer.Argument(help="CSV of image points of the right camera.")],
    out: Annotated[Path, typer.Option(help="CameraParameters.dat to write.")],
    image_size: Annotated[str, typer.Option(help="Image size, px.")] = "568x416",
    pixel_size: Annotated[
        str | None,
        typer.Option(help="Pixel width and height, mm: 0.01,0.00845.", show_default="the cart's pixels"),
    ] = None,
) -> None:
    """Calibrate both cameras from one shot of a control field and write their parameters (thesis Table 3.3)."""
    from commands.programs_1995.points import read_image_points  # noqa: PLC0415 - loads SciPy
    from commands.shared.calibration_options import parse_sensor  # noqa: PLC0415
    from commands.shared.rig_files import write_rig_file  # noqa: PLC0415
    from spinewatch.calibration.points import Shot  # noqa: PLC0415
    from spinewatch.calibration.stereo import calibrate_stereo  # noqa: PLC0415

    sensor = parse_sensor(image_size, pixel_size)
    shot = Shot("1", read_image_points(left), read_image_points(right))
    calibration = calibrate_stereo([shot], (sensor, sensor))
    error_px = write_rig_file(calibration.rig, out, "1995")
    typer.echo(
        f"residuals {calibration.adjustment.rms_px:.4f} px RMS; {len(calibration.blunders)} points removed"
    )
    typer.echo(f"{out}: distortion about the plate's origin within {error_px:.4f} px")
