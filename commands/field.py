"""``spinewatch field``: try a control field by simulation before it is built, or design one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from commands.shared.numbers import MAX_SEED

cli = typer.Typer(help="Try or design a control field.", no_args_is_help=True)


@cli.command("try")
def try_field(
    field: Annotated[str, typer.Argument(help="CSV file id,x_mm,y_mm,z_mm, or the built-in pegboard-1995.")],
    rig: Annotated[Path, typer.Option(help="Rig JSON: calibration of both cameras.")],
    centre: Annotated[
        bool,
        typer.Option(
            "--centre", help="Move the field's centroid to the point where the optical axes converge."
        ),
    ] = False,
    noise: Annotated[
        float, typer.Option(min=0.001, max=5.0, help="Standard deviation of image points, per axis, px.")
    ] = 0.1,
    point_error: Annotated[
        float,
        typer.Option(min=0.0, max=100.0, help="Standard deviation of the points as built, per axis, mm."),
    ] = 0.0,
    trials: Annotated[int, typer.Option(min=1, max=10_000, help="Number of simulated calibrations.")] = 20,
    seed: Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Seed of the random numbers.")] = 0,
) -> None:
    """Simulate calibrations with a control field before it is built."""
    import numpy as np  # noqa: PLC0415 - --help does not need it

    from commands.shared.calibration import read_field  # noqa: PLC0415 - loads OpenCV and SciPy
    from commands.shared.plan_tables import print_control_field_trial  # noqa: PLC0415
    from commands.shared.rig import read_rig  # noqa: PLC0415
    from spinewatch.planning.control_field_trial import try_control_field  # noqa: PLC0415
    from spinewatch.simulation.rigs import convergence_point  # noqa: PLC0415

    cameras, points = read_rig(rig), read_field(field)
    if centre:
        shift_mm = convergence_point(cameras) - points.points_mm.mean(axis=0)
        points = replace(points, points_mm=points.points_mm + shift_mm)
    rng = np.random.default_rng(seed)
    trial = try_control_field(points, cameras, noise, rng, point_sd_mm=point_error, trials=trials)
    print_control_field_trial(trial, trials)


@cli.command("design")
def design_field(
    out: Annotated[Path, typer.Argument(help="CSV file to write the control field to.")],
    rows: Annotated[int, typer.Option(min=3, max=30, help="Number of rows of pegs.")] = 5,
    columns: Annotated[int, typer.Option(min=3, max=30, help="Number of columns of pegs.")] = 6,
    spacing: Annotated[
        float, typer.Option(min=5.0, max=1000.0, help="Distance between neighbouring pegs, mm.")
    ] = 127.0,
    seed: Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Seed of the random heights.")] = 0,
) -> None:
    """Design a peg board in which low and high pegs alternate, for `field try` and `calibrate`."""
    import numpy as np  # noqa: PLC0415 - --help does not need it

    from commands.shared.files import write_text  # noqa: PLC0415
    from spinewatch.calibration.control_field import low_high_field  # noqa: PLC0415
    from spinewatch.calibration.point_tables import control_field_csv  # noqa: PLC0415

    field = low_high_field(rows, columns, spacing, np.random.default_rng(seed))
    write_text(out, control_field_csv(field))
    typer.echo(f"{out}: {field.name}, {len(field)} points")
