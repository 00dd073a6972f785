"""``spinewatch calibrate``: a rig file and a report from images of a control field, or from image points."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from commands.shared.files import printable_name, require_ending, write_text
from spinewatch.errors import ParameterError

if TYPE_CHECKING:
    from spinewatch.calibration.solve.parameters import SolveParameters


def calibrate(  # noqa: PLR0913, PLR0917 - one argument per option
    files: Annotated[
        list[Path],
        typer.Argument(
            help="LEFT RIGHT images of each shot; or one CSV file of image points (id,x_mm,y_mm,z_mm,u_px,v_px) per"
            " camera: two files give a rig, any other number gives cameras.",
            metavar="LEFT RIGHT [LEFT RIGHT ...]",
        ),
    ],
    control_field: Annotated[
        str | None,
        typer.Option(
            help="CSV file id,x_mm,y_mm,z_mm, or the built-in pegboard-1995, or a flat board in several tilted shots:"
            " chessboard:9x6:25 (inner corners, mm) or charuco:7x5:40:30:DICT_5X5_100 (squares, mm of a square and"
            " of a marker, dictionary)."
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="File to write the rig or cameras JSON to.")] = None,
    report: Annotated[Path | None, typer.Option(help="File to write the HTML report to.")] = None,
    name: Annotated[str, typer.Option(help="Name of the rig.")] = "rig",
    verify: Annotated[
        int, typer.Option(min=0, max=1000, help="Number of trailing shots held out for verification.")
    ] = 0,
    pixel_size: Annotated[
        str | None,
        typer.Option(help="Pixel width and height, mm: 0.01,0.00845.", show_default="the cart's pixels"),
    ] = None,
    image_size: Annotated[
        str | None, typer.Option(help="Image size, px: 568x416. Required with image points.")
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(
            help="Interior parameters to adjust: f,x0,y0,K1.", show_default="those that the points determine"
        ),
    ] = None,
    fix: Annotated[str | None, typer.Option(help="Parameters held fixed: x0=0,y0=0.")] = None,
    estimate_aspect: Annotated[
        bool, typer.Option(help="Also adjust the aspect ratio of the pixels.")
    ] = False,
) -> None:
    """Calibrate cameras with a control field; print the calibration and its quality as JSON."""
    from commands.shared.calibration_options import parse_solve_options  # noqa: PLC0415 - loads SciPy

    if report is not None:
        require_ending(report, (".html", ".htm"), "a report of a calibration")
    if out is not None:
        require_ending(out, (".json", ""), "a rig as JSON")
    solve = parse_solve_options(free, fix, estimate_aspect)
    name = printable_name(name)
    if not all(path.suffix.lower() == ".csv" for path in files):
        document = _from_images(files, control_field, solve, pixel_size, verify, name)
    elif len(files) == 2:
        from commands.shared.calibration import calibrate_points  # noqa: PLC0415 - loads OpenCV and SciPy
        from commands.shared.terminal_progress import terminal_progress  # noqa: PLC0415

        pair = (files[0], files[1])
        with terminal_progress() as progress:
            document = calibrate_points(pair, solve, image_size, pixel_size, verify, name, progress)
    else:
        from commands.shared.cameras import calibrate_camera_points  # noqa: PLC0415 - loads SciPy

        if verify:
            raise ParameterError("--verify needs a stereo pair; give two CSV files, or omit the option")
        document = calibrate_camera_points(files, solve, image_size, pixel_size)
    # Printed first: a file that cannot be written does not lose the calibration.
    sys.stdout.write(json.dumps(document, indent=2) + "\n")
    sys.stdout.flush()
    if out is not None:
        cameras = document["rig"] if "rig" in document else {"cameras": document["cameras"]}
        write_text(out, json.dumps(cameras, indent=2) + "\n")
    if report is not None:
        from reports.calibration import calibration_report  # noqa: PLC0415 - loads Jinja2
        from reports.cameras import cameras_report  # noqa: PLC0415

        page = calibration_report if "rig" in document else cameras_report
        write_text(report, page(document))


def _from_images(
    files: list[Path],
    control_field: str | None,
    solve: SolveParameters,
    pixel_size: str | None,
    verify: int,
    name: str,
) -> dict[str, Any]:
    if len(files) % 2:
        raise ParameterError(f"{len(files)} image files were given; give LEFT and RIGHT of every shot")
    from commands.shared.calibration import calibrate_images  # noqa: PLC0415 - loads OpenCV and SciPy
    from commands.shared.terminal_progress import terminal_progress  # noqa: PLC0415

    pairs = list(zip(files[::2], files[1::2], strict=True))
    with terminal_progress() as progress:
        return calibrate_images(pairs, control_field, solve, pixel_size, verify, name, progress)
