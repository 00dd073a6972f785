"""``spinewatch ndlt``: direct linear transformation of one camera, the NDLT of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def ndlt(
    points: Annotated[Path, typer.Argument(help="CSV of image points: id,x_mm,y_mm,z_mm,u_px,v_px.")],
    image_size: Annotated[str, typer.Option(help="Image size, px.")] = "568x416",
    pixel_size: Annotated[
        str | None,
        typer.Option(help="Pixel width and height, mm: 0.01,0.00845.", show_default="the cart's pixels"),
    ] = None,
) -> None:
    """Print the eleven constants and K1 of eq. 3.1, and the camera that they describe, as initial values."""
    from commands.programs_1995.points import read_image_points  # noqa: PLC0415 - loads SciPy
    from commands.shared.calibration_options import parse_sensor  # noqa: PLC0415
    from spinewatch.calibration.solve.dlt import check_solvable, solve_dlt  # noqa: PLC0415

    sensor = parse_sensor(image_size, pixel_size)
    image = read_image_points(points)
    check_solvable(image, str(points))
    solution = solve_dlt(image, sensor, str(points))
    for k, value in enumerate(solution.L.ravel()[:11], 1):
        typer.echo(f"L{k:<2} {value: .8e}")
    typer.echo(f"K1  {solution.K1: .8e} per mm^2")
    camera = solution.camera
    typer.echo("position  " + " ".join(f"{x:.4f}" for x in camera.position_mm) + " mm")
    typer.echo(
        "angles    " + " ".join(f"{x:.4f}" for x in camera.rotation_deg) + " degrees (omega, phi, kappa)"
    )
    typer.echo(f"f         {camera.focal_length_mm:.4f} mm")
    typer.echo("x0 y0     " + " ".join(f"{x:.4f}" for x in camera.principal_point_mm) + " mm")
    typer.echo(f"scale     {solution.aspect:.4f} (eq. 3.5)")
