"""``spinewatch templates build``: a template set from annotated images."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from commands.shared.files import InputError, read_image, read_json, write_bytes

if TYPE_CHECKING:
    from spinewatch.camera import Rig
    from spinewatch.detection.candidates.template_building import AnnotatedView
    from spinewatch.imaging.frame import Side

cli = typer.Typer(help="Template sets of the detector.", no_args_is_help=True)

_MIN_VISIBLE = 0.9
"""Balls of a lower visible fraction are no samples."""


@cli.callback()
def templates() -> None:
    """Build the template sets that the detector compares images with."""


@cli.command()
def build(
    folders: Annotated[list[Path], typer.Argument(help="Folders with left.png, right.png and truth.json.")],
    rig: Annotated[Path, typer.Option(help="Rig JSON of the cameras that took the images.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
    version: Annotated[str, typer.Option(help="Name of the set, stored with every result.")],
    gray_classes: Annotated[
        int | None,
        typer.Option(
            min=1, max=1000, help="Number of classes of gray templates.", show_default="by silhouette"
        ),
    ] = None,
    edge_classes: Annotated[
        int | None,
        typer.Option(
            min=1, max=1000, help="Number of classes of edge templates.", show_default="by silhouette"
        ),
    ] = None,
    directivity_classes: Annotated[
        int | None,
        typer.Option(
            min=1, max=1000, help="Number of classes of directivity templates.", show_default="by silhouette"
        ),
    ] = None,
) -> None:
    """Build a template set from images whose ball centres are annotated (thesis section 4.3.2)."""
    # Imported here, so that the command line starts without libraries that it does not need.
    from commands.shared.rig import read_rig  # noqa: PLC0415
    from commands.shared.template_report import print_built_set  # noqa: PLC0415
    from spinewatch.detection.candidates.search import DetectionParameters  # noqa: PLC0415
    from spinewatch.detection.candidates.template_building import BuildParameters, build_template_set  # noqa: PLC0415
    from spinewatch.detection.candidates.templates import write_template_set  # noqa: PLC0415
    from spinewatch.imaging.frame import SIDES  # noqa: PLC0415
    from spinewatch.parameters import Parameters  # noqa: PLC0415

    cameras = read_rig(rig)
    diameter_mm = Parameters().ball_diameter_mm
    views = [_view(folder, side, cameras, diameter_mm) for folder in folders for side in SIDES]
    parameters = BuildParameters(gray_classes, edge_classes, directivity_classes)
    built = build_template_set(views, version, parameters, DetectionParameters())
    write_bytes(out, write_template_set(built.templates))
    print_built_set(built)
    typer.echo(f"{out}: version {version}, {sum(len(view.centres_px) for view in views)} balls")


@cli.command("build-1995")
def build_1995(
    folders: Annotated[list[Path], typer.Argument(help="Folders with left.png, right.png and truth.json.")],
    rig: Annotated[Path, typer.Option(help="Rig JSON of the cameras that took the images.")],
    out: Annotated[Path, typer.Option(help="File to write.")],
) -> None:
    """Build the template trees of the published detector: six gray and four edge classes of raw averages."""
    from commands.shared.rig import read_rig  # noqa: PLC0415
    from commands.shared.template_report import print_proximities  # noqa: PLC0415
    from spinewatch.imaging.frame import SIDES  # noqa: PLC0415
    from spinewatch.parameters import Parameters  # noqa: PLC0415
    from spinewatch.thesis_1995.template_trees import TreeParameters, build_trees, write_trees  # noqa: PLC0415

    cameras = read_rig(rig)
    diameter_mm = Parameters().ball_diameter_mm
    trees = build_trees(
        [_view(folder, side, cameras, diameter_mm) for folder in folders for side in SIDES], TreeParameters()
    )
    write_bytes(out, write_trees(trees))
    print_proximities({str(space): tree for space, tree in trees.trees.items()})
    typer.echo(f"{out}: template trees of 1995")


def _view(folder: Path, side: Side, rig: Rig, diameter_mm: float) -> AnnotatedView:
    """Return an image of a folder and its clearly visible balls."""
    import numpy as np  # noqa: PLC0415

    from spinewatch.detection.candidates.template_building import AnnotatedView  # noqa: PLC0415
    from spinewatch.errors import ImageError  # noqa: PLC0415
    from spinewatch.imaging.decoding import decode_image  # noqa: PLC0415
    from spinewatch.imaging.frame import Frame  # noqa: PLC0415

    image, truth = folder / f"{side}.png", folder / "truth.json"
    camera = rig.left if side == "left" else rig.right
    try:
        pixels = decode_image(read_image(image))
    except ImageError as error:
        raise ImageError(f"{image}: {error}") from error
    try:
        balls = [ball for triad in read_json(truth)["triads"] for ball in triad["balls"].values()]
        visible = [ball for ball in balls if ball[side]["visible_fraction"] > _MIN_VISIBLE]
        centres_px = np.array([ball[side]["center_px"] for ball in visible])
        depths_mm = [camera.depth_mm(ball["center_mm"]) for ball in visible]
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise InputError(f"{truth} does not describe the balls of a scene; see samples/README.md") from error
    diameters_px = np.array([camera.ball_diameter_px(diameter_mm, depth) for depth in depths_mm])
    return AnnotatedView(Frame(pixels, side), centres_px, diameters_px)
