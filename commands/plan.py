"""``spinewatch plan``: what a rig and its markers will be able to tell, before surgery."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

from commands.process import label_names


def plan(
    rig: Annotated[Path, typer.Option(help="Rig JSON: the calibration of both cameras.")],
    levels: Annotated[
        str, typer.Option(help="Vertebrae with a triad, the reference first.")
    ] = "L1,T11,T9,T7",
    triad_size: Annotated[float, typer.Option(min=0.1, help="1 is the marker of 10, 14, 18 mm legs.")] = 1.0,
    spacing: Annotated[float, typer.Option(min=1.0, help="Distance between neighbours, mm.")] = 50.0,
    spine_axis: Annotated[Literal["x", "y"], typer.Option(help="Object axis of the row.")] = "x",
    noise: Annotated[float, typer.Option(min=0.001, help="Standard deviation of a centre, px.")] = 0.1,
    common: Annotated[
        float, typer.Option(min=0.0, help="Pointing error that a view's balls share, mrad.")
    ] = 0.08,
    disc: Annotated[
        float | None, typer.Option(min=5.0, help="Find the best marker in a disc of this radius, mm.")
    ] = None,
) -> None:
    """Predict standard deviations of position, rotation and Cobb angle; with --disc, of the best marker that fits."""
    names = label_names(levels, None)
    from rich.console import Console  # noqa: PLC0415 - --help can do without
    from rich.table import Table  # noqa: PLC0415

    from commands.shared.pair import read_rig  # noqa: PLC0415
    from spinewatch.markers import FLAT_10_14_18, scaled  # noqa: PLC0415
    from spinewatch.planning import accuracy as planner  # noqa: PLC0415
    from spinewatch.simulation.scenes import aim_point  # noqa: PLC0415

    cameras = read_rig(rig)
    row = planner.straight_row(names, aim_point(cameras), spacing, "xy".index(spine_axis))
    model = scaled(FLAT_10_14_18, triad_size)
    if disc is not None:
        model = planner.best_marker(cameras, row, noise, disc)
    planned = planner.plan(cameras, model, names, row, noise, common)
    table = Table("", "x mm", "y mm", "z mm", "in plane°", "out of plane°", "motion mm", "motion°", "in view")
    for triad in planned.triads:
        numbers = [*triad.position_sd_mm, triad.in_plane_sd_deg, triad.out_of_plane_sd_deg]
        motion = (
            " ".join("-" if math.isnan(value) else f"{value:.2f}" for value in values)
            for values in (triad.motion_sd_mm, triad.motion_sd_deg)
        )
        table.add_row(
            triad.vertebra, *(f"{n:.2f}" for n in numbers), *motion, "yes" if triad.in_view else "NO"
        )
    console = Console() if Console().is_terminal else Console(width=110)
    console.print(table)
    console.print(
        f"Standard deviations for centres of {noise:g} px; motion: between two stages, relative to {names[0]}"
    )
    console.print(f"Cobb angle {names[0]} to {names[-1]}: {planned.cobb_sd_deg:.2f} degrees at one stage")
    balls = "; ".join(
        f"{name} ({x:.1f}, {y:.1f})"
        for name, (x, y, _) in zip(model.balls, model.coordinates_mm, strict=True)
    )
    distances = ", ".join(f"{distance:.1f}" for distance in model.distances_mm)
    console.print(f"Marker {model.name}: {balls}; distances {distances} mm")
