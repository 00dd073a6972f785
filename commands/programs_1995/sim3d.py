"""``spinewatch sim3d``: accuracy of reconstructed control points, the SIM3D of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def sim3d(
    cameras: Annotated[Path, typer.Argument(help="CameraParameters.dat or rig JSON.")],
    left: Annotated[Path, typer.Argument(help="CSV of image points of the left camera.")],
    right: Annotated[Path, typer.Argument(help="CSV of image points of the right camera.")],
) -> None:
    """Print mean and standard deviation of the residuals of reconstructed control points (thesis Table 3.4)."""
    from commands.programs_1995.inputs import read_cameras  # noqa: PLC0415 - loads SciPy
    from commands.programs_1995.points import read_image_points  # noqa: PLC0415
    from spinewatch.calibration.points import Shot  # noqa: PLC0415
    from spinewatch.calibration.quality.accuracy import shot_accuracy  # noqa: PLC0415

    shot = Shot("1", read_image_points(left), read_image_points(right))
    accuracy = shot_accuracy(read_cameras(cameras), shot, used=False, defines_object_space=True)
    typer.echo(f"{len(accuracy.ids)} points, object space, mm")
    typer.echo("         X        Y        Z")
    for name, values in (("mean", accuracy.mean_mm), ("sd", accuracy.sd_mm)):
        typer.echo(f"{name:4} " + " ".join(f"{value:8.4f}" for value in values))
