"""``spinewatch match``: triads from two feature lists by the published method, the MATCH-POINT of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from spinewatch.errors import ParameterError


def match(
    features: Annotated[
        list[Path],
        typer.Argument(
            help="PixelsLEFT.dat and PixelsRIGHT.dat, or one features.json of `spinewatch simulate`."
        ),
    ],
    cameras: Annotated[Path, typer.Option(help="CameraParameters.dat or rig JSON.")],
    labels: Annotated[
        str, typer.Option(help="Marked vertebrae in order of increasing coordinate along the spine.")
    ],
    out: Annotated[
        Path, typer.Option(help="Folder for MatchCoords.dat, WorldPoints.dat, SpacoOUT.dat, SpineStage.dat.")
    ],
    spine_axis: Annotated[Literal["x", "y"], typer.Option(help="Object-space axis along the spine.")] = "x",
    images: Annotated[
        tuple[Path, Path] | None,
        typer.Option(
            help="Left and right image: candidate sets are refined by their surroundings (eq. 5.11)."
        ),
    ] = None,
    tolerance: Annotated[
        float, typer.Option(min=0.1, max=100.0, help="Tolerance of a distance of the marker, mm (eq. 5.16).")
    ] = 3.5,
) -> None:
    """Match features, reconstruct points and find triads by the method of 1995; print every triplet's verdict."""
    from commands.programs_1995.explanation import print_triplets, write_matching  # noqa: PLC0415 - loads SciPy
    from commands.programs_1995.inputs import read_cameras, read_feature_list, read_feature_pair  # noqa: PLC0415
    from commands.shared.files import read_image  # noqa: PLC0415
    from commands.shared.labels import parse_labels  # noqa: PLC0415
    from commands.shared.pair import decode_file  # noqa: PLC0415
    from spinewatch.thesis_1995.match_point import MatchPointParameters, match_point  # noqa: PLC0415

    if len(features) not in (1, 2):
        raise ParameterError(f"{len(features)} feature files were given; give the left and the right list")
    if len(features) == 1:
        left, right = read_feature_pair(features[0])
    else:
        left, right = read_feature_list(features[0]), read_feature_list(features[1])
    rig = read_cameras(cameras)
    pair = None
    if images is not None:
        pair = (
            decode_file(images[0], read_image(images[0]), rig.left.image_size_px),
            decode_file(images[1], read_image(images[1]), rig.right.image_size_px),
        )
    names = parse_labels(labels, None)
    parameters = MatchPointParameters(distance_tolerance_mm=tolerance)
    found = match_point(left, right, rig, names, parameters, axis=spine_axis, images=pair)
    write_matching(found, left, right, rig, out)
    print_triplets(found)
