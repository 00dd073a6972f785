"""``spinewatch plan``: accuracy that a rig, a marker or a control field will give, and the disparities of a rig."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from commands.shared.labels import parse_labels

cli = typer.Typer(help="Predict the accuracy of a rig, a marker or a control field.", no_args_is_help=True)

RigFile = Annotated[Path, typer.Option(help="Rig JSON: calibration of both cameras.")]
Noise = Annotated[float, typer.Option(min=0.001, help="Standard deviation of image points, per axis, px.")]


@cli.command()
def accuracy(
    rig: RigFile,
    levels: Annotated[
        str, typer.Option(help="Vertebrae with a triad, the reference first.")
    ] = "L1,T11,T9,T7",
    triad_size: Annotated[
        float, typer.Option(min=0.1, help="Scale of the marker; 1 has legs of 10, 14 and 18 mm.")
    ] = 1.0,
    spacing: Annotated[float, typer.Option(min=1.0, help="Distance between neighbours, mm.")] = 50.0,
    spine_axis: Annotated[Literal["x", "y"], typer.Option(help="Object axis along the spine.")] = "x",
    noise: Noise = 0.1,
    common: Annotated[
        float, typer.Option(min=0.0, help="Pointing error shared by the balls of a triad in a view, mrad.")
    ] = 0.08,
    disc: Annotated[
        float | None, typer.Option(min=5.0, help="Design the best marker in a disc of this radius, mm.")
    ] = None,
) -> None:
    """Predict the accuracy of positions, rotations, motion and Cobb angle."""
    names = parse_labels(levels, None)
    from commands.shared.plan_tables import print_accuracy  # noqa: PLC0415 - loads SciPy, which --help does not need
    from commands.shared.rig import read_rig  # noqa: PLC0415
    from spinewatch.markers import FLAT_10_14_18, scaled  # noqa: PLC0415
    from spinewatch.planning.accuracy import expected_accuracy, straight_chain  # noqa: PLC0415
    from spinewatch.planning.marker_design import design_marker  # noqa: PLC0415
    from spinewatch.simulation.rigs import convergence_point  # noqa: PLC0415

    cameras = read_rig(rig)
    chain = straight_chain(names, convergence_point(cameras), spacing, "xy".index(spine_axis))
    model = scaled(FLAT_10_14_18, triad_size) if disc is None else design_marker(cameras, chain, noise, disc)
    print_accuracy(expected_accuracy(cameras, model, names, chain, noise, common), noise)


@cli.command()
def control_field(
    field: Annotated[str, typer.Argument(help="CSV file id,x_mm,y_mm,z_mm, or the built-in pegboard-1995.")],
    rig: RigFile,
    centre: Annotated[
        bool,
        typer.Option(
            "--centre", help="Move the field's centroid to the point where the optical axes converge."
        ),
    ] = False,
    noise: Noise = 0.1,
    point_error: Annotated[
        float, typer.Option(min=0.0, help="Standard deviation of the points as built, per axis, mm.")
    ] = 0.0,
    trials: Annotated[int, typer.Option(min=1, help="Number of simulated calibrations.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 0,
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


@cli.command()
def low_high_field(
    out: Annotated[Path, typer.Argument(help="CSV file to write the control field to.")],
    rows: Annotated[int, typer.Option(help="Number of rows of pegs.")] = 5,
    columns: Annotated[int, typer.Option(help="Number of columns of pegs.")] = 6,
    spacing: Annotated[float, typer.Option(help="Distance between neighbouring pegs, mm.")] = 127.0,
    seed: Annotated[int, typer.Option(help="Seed of the random heights.")] = 0,
) -> None:
    """Design a peg board in which low and high pegs alternate, for `plan control-field` and `calibrate`."""
    import numpy as np  # noqa: PLC0415 - --help does not need it

    from commands.shared.files import write_text  # noqa: PLC0415
    from spinewatch.calibration.control_field import low_high_field as design  # noqa: PLC0415
    from spinewatch.calibration.point_tables import control_field_csv  # noqa: PLC0415

    field = design(rows, columns, spacing, np.random.default_rng(seed))
    write_text(out, control_field_csv(field))
    typer.echo(f"{out}: {field.name}, {len(field)} points")


@cli.command()
def disparity(
    rig: RigFile,
    heights: Annotated[
        tuple[float, float], typer.Option(help="Lowest and highest plane, object space, mm.")
    ] = (0.0, 120.0),
    planes: Annotated[int, typer.Option(min=2, help="Number of planes.")] = 7,
) -> None:
    """Print the disparities of a rig over its field of view and depth."""
    from commands.shared.plan_tables import print_disparity  # noqa: PLC0415 - --help does not need it
    from commands.shared.rig import read_rig  # noqa: PLC0415
    from spinewatch.planning.disparity import disparity_grid  # noqa: PLC0415

    print_disparity(disparity_grid(read_rig(rig), heights, planes))
