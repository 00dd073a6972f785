"""``spinewatch plan``: accuracy that a rig and a marker will give."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from commands.shared.labels import parse_labels


def plan(  # noqa: PLR0913, PLR0917 - one parameter per option
    rig: Annotated[Path, typer.Option(help="Rig JSON: calibration of both cameras.")],
    levels: Annotated[
        str, typer.Option(help="Vertebrae with a triad, the reference first.")
    ] = "L1,T11,T9,T7",
    marker: Annotated[str, typer.Option(help="Name of the marker.")] = "flat-10-14-18",
    triad_size: Annotated[float, typer.Option(min=0.1, max=10.0, help="Scale of the marker.")] = 1.0,
    spacing: Annotated[
        float, typer.Option(min=1.0, max=200.0, help="Distance between neighbours, mm.")
    ] = 50.0,
    spine_axis: Annotated[Literal["x", "y"], typer.Option(help="Object axis along the spine.")] = "x",
    noise: Annotated[
        float, typer.Option(min=0.001, max=5.0, help="Standard deviation of image points, per axis, px.")
    ] = 0.1,
    common: Annotated[
        float,
        typer.Option(min=0.0, max=5.0, help="Pointing error shared by the balls of a triad in a view, mrad."),
    ] = 0.12,
    disc: Annotated[
        float | None,
        typer.Option(min=5.0, max=100.0, help="Design the best marker in a disc of this radius, mm."),
    ] = None,
) -> None:
    """Predict the accuracy of positions, rotations, motion and Cobb angle."""
    names = parse_labels(levels, None)
    from commands.shared.plan_tables import print_accuracy  # noqa: PLC0415 - loads SciPy, which --help does not need
    from commands.shared.rig import read_rig  # noqa: PLC0415
    from spinewatch import markers  # noqa: PLC0415
    from spinewatch.planning.accuracy import expected_accuracy, straight_chain  # noqa: PLC0415
    from spinewatch.planning.marker_design import design_marker  # noqa: PLC0415
    from spinewatch.simulation.rigs import convergence_point  # noqa: PLC0415

    cameras = read_rig(rig)
    chain = straight_chain(names, convergence_point(cameras), spacing, "xy".index(spine_axis))
    model = (
        markers.scaled(markers.marker(marker), triad_size)
        if disc is None
        else design_marker(cameras, chain, noise, disc)
    )
    print_accuracy(expected_accuracy(cameras, model, names, chain, noise, common), noise)
