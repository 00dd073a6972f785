"""``spinewatch disparity``: the disparities of a rig over its field of view and depth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def disparity(
    rig: Annotated[Path, typer.Option(help="Rig JSON: calibration of both cameras.")],
    heights: Annotated[
        tuple[float, float],
        typer.Option(min=-1e5, max=1e5, help="Lowest and highest plane, object space, mm."),
    ] = (0.0, 120.0),
    planes: Annotated[int, typer.Option(min=2, max=25, help="Number of planes.")] = 7,
) -> None:
    """Print the disparities of a rig over its field of view and depth."""
    from commands.shared.plan_tables import print_disparity  # noqa: PLC0415 - --help does not need it
    from commands.shared.rig import read_rig  # noqa: PLC0415
    from spinewatch.planning.disparity import disparity_grid  # noqa: PLC0415

    print_disparity(disparity_grid(read_rig(rig), heights, planes))
