"""``spinewatch calibrate``: from pictures of a control field, or from coordinates, to a rig file and a report."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from commands.shared.files import write_text
from spinewatch.errors import ParameterError


def calibrate(  # noqa: PLR0913, PLR0917 - one argument an option
    files: Annotated[
        list[Path],
        typer.Argument(
            help="LEFT RIGHT of each shot: pictures; or one CSV of image points (id,x_mm,y_mm,z_mm,u_px,v_px) for"
            " each camera: two make a rig, any other number cameras.",
            metavar="LEFT RIGHT [LEFT RIGHT ...]",
        ),
    ],
    control_field: Annotated[
        str | None, typer.Option(help="CSV id,x_mm,y_mm,z_mm, or a built-in name: pegboard-1995.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write the rig JSON, or the cameras JSON, here.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a report here, HTML.")] = None,
    name: Annotated[str, typer.Option(help="Name of the rig.")] = "rig",
    verify: Annotated[int, typer.Option(help="The last N shots only verify, they are not used.")] = 0,
    pixel_size: Annotated[
        str | None, typer.Option(help="Pixel width and height in mm: 0.01,0.00845. The cart's by default.")
    ] = None,
    image_size: Annotated[str | None, typer.Option(help="With coordinates: image size, 568x416.")] = None,
    free: Annotated[
        str | None, typer.Option(help="Interior parameters to adjust: f,x0,y0,K1. Chosen by default.")
    ] = None,
    fix: Annotated[str | None, typer.Option(help="Parameters held at a value: x0=0,y0=0.")] = None,
    estimate_aspect: Annotated[bool, typer.Option(help="Adjust the pixels' aspect too.")] = False,
) -> None:
    """Calibrate both cameras from shots of a control field; prints everything found as JSON."""
    from commands.shared.calibration import (  # noqa: PLC0415 - loads OpenCV and SciPy, which --help can do without
        run_images,
        run_points,
        solve_options,
    )
    from commands.shared.progress import terminal_progress  # noqa: PLC0415

    solve = solve_options(free, fix, estimate_aspect)
    points = _are_points(files)
    if points and len(files) != 2:
        from commands.shared.cameras import run_cameras  # noqa: PLC0415

        if verify:
            raise ParameterError("--verify needs a stereo pair; give two CSV files, or leave the option out")
        document = run_cameras(files, solve, image_size, pixel_size)
        rig = {"cameras": document["cameras"]}
    else:
        pairs = _pairs(files, verify, points=points)
        if points:
            document = run_points(pairs, solve, image_size, pixel_size, verify, name)
        else:
            with terminal_progress() as progress:
                document = run_images(pairs, control_field, solve, pixel_size, verify, name, progress)
        rig = document["rig"]
    if out is not None:
        write_text(out, json.dumps(rig, indent=2) + "\n")
    if report is not None:
        from reports.calibration import calibration_report, cameras_report  # noqa: PLC0415

        page = cameras_report if "cameras" in rig else calibration_report
        write_text(report, page(document))
    sys.stdout.write(json.dumps(document, indent=2) + "\n")


def _pairs(files: list[Path], verify: int, *, points: bool) -> list[tuple[Path, Path]]:
    if len(files) % 2:
        raise ParameterError(f"{len(files)} files were given; give LEFT and RIGHT of every shot")
    pairs = list(zip(files[::2], files[1::2], strict=True))
    if not 0 <= verify < len(pairs) and not points:
        raise ParameterError(
            f"--verify is {verify} of {len(pairs)} shots; leave at least one to calibrate with"
        )
    return pairs


def _are_points(files: list[Path]) -> bool:
    return all(path.suffix.lower() == ".csv" for path in files)
