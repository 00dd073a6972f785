"""``spinewatch detect``: features of one image by the published method, the DETECT-POINT of the thesis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer


def detect(
    image: Annotated[Path, typer.Argument(help="Image: Sun raster, PNG, TIFF or JPEG.")],
    out: Annotated[Path, typer.Option(help="FEATURES.DAT to write.")],
    ball: Annotated[str, typer.Option(help="Width and height of a ball, px.")] = "9.0,10.65",
    features: Annotated[int, typer.Option(min=1, max=1000, help="Number of features expected.")] = 15,
    size_reduction: Annotated[
        Literal["sd", "mean", "none"],
        typer.Option(
            help="Statistic of the rows by which the surgical field is found; none searches the image."
        ),
    ] = "sd",
    explain: Annotated[
        Path | None,
        typer.Option(help="Folder for pre.ras, edge.ras, crossGl.ras, crossEd.ras and final.ras."),
    ] = None,
) -> None:
    """Find ball features in one image by the method of 1995 and write them as FEATURES.DAT."""
    from commands.programs_1995.explanation import write_detection  # noqa: PLC0415 - loads OpenCV and SciPy
    from commands.programs_1995.inputs import STATISTICS, feature_list  # noqa: PLC0415
    from commands.shared.calibration_options import two_numbers  # noqa: PLC0415
    from commands.shared.files import read_image, write_text  # noqa: PLC0415
    from spinewatch.errors import ImageError  # noqa: PLC0415
    from spinewatch.imaging.decoding import decode_image  # noqa: PLC0415
    from spinewatch.imaging.frame import Frame  # noqa: PLC0415
    from spinewatch.thesis_1995.data_files import format_features  # noqa: PLC0415
    from spinewatch.thesis_1995.detect_point import DetectPointParameters, detect_point  # noqa: PLC0415
    from spinewatch.thesis_1995.preprocessing import PreprocessingParameters  # noqa: PLC0415

    parameters = DetectPointParameters(
        preprocessing=PreprocessingParameters(statistic=STATISTICS[size_reduction]),
        expected_features=features,
    )
    try:
        frame = Frame(decode_image(read_image(image)), "left")
        found = detect_point(frame, two_numbers(ball, ",", "--ball", (2, 200)), parameters)
    except ImageError as error:
        raise ImageError(f"{image}: {error}") from error
    write_text(out, format_features(feature_list(found.features)))
    if explain is not None:
        write_detection(found, explain)
    first, last = found.preprocessed.rows
    typer.echo(f"{out}: {len(found.features)} features in rows {first} to {last - 1}")
