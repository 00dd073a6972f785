"""``spinewatch spaco``: object points of given image points, the SPACO of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def spaco(
    pairs: Annotated[
        Path, typer.Argument(help="MatchCoords.dat: number left right x_left y_left x_right y_right, mm.")
    ],
    cameras: Annotated[Path, typer.Option(help="CameraParameters.dat or rig JSON.")],
) -> None:
    """Print the points of pairs of image points with their residuals (thesis section 5.5)."""
    import numpy as np  # noqa: PLC0415 - --help does not need it

    from commands.programs_1995.inputs import SIGMA_PX, read_cameras  # noqa: PLC0415 - loads SciPy
    from commands.shared.files import InputError, read_text  # noqa: PLC0415
    from spinewatch.errors import SpinewatchError  # noqa: PLC0415
    from spinewatch.geometry.rays import Rays  # noqa: PLC0415
    from spinewatch.geometry.triangulation import triangulate  # noqa: PLC0415
    from spinewatch.thesis_1995.data_files import parse_match_coordinates  # noqa: PLC0415

    try:
        given = parse_match_coordinates(read_text(pairs))
    except SpinewatchError as error:
        raise InputError(f"{pairs}: {error}") from error
    rig = read_cameras(cameras)
    rays = []
    for camera, ideal_mm in ((rig.left, given.left_mm), (rig.right, given.right_mm)):
        covariance_mm2 = np.diag(np.square(SIGMA_PX * np.array(camera.pixel_size_mm)))
        pinhole = camera.pinhole
        rays.append(
            Rays(pinhole, ideal_mm, np.tile(covariance_mm2, (len(ideal_mm), 1, 1)), pinhole.rays(ideal_mm))
        )
    found = triangulate(rays)
    sd_mm = np.sqrt(np.diagonal(found.covariance_mm2, axis1=1, axis2=2))
    typer.echo("# number X_mm Y_mm Z_mm sd_X_mm sd_Y_mm sd_Z_mm parallax_mm")
    for number, (point, sd, parallax) in enumerate(
        zip(found.position_mm, sd_mm, found.parallax_mm, strict=True), 1
    ):
        typer.echo(" ".join([str(number), *(f"{x:.4f}" for x in (*point, *sd, parallax))]))
