"""``spinewatch templates build``: a template set from annotated images."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from spinewatch.camera import Rig
    from spinewatch.detection.candidates.template_building import AnnotatedView
    from spinewatch.detection.candidates.templates import Side

cli = typer.Typer(help="Template sets of the detector.", no_args_is_help=True)

Classes = Annotated[
    int | None, typer.Option(min=1, help="Fix the number of classes.", show_default="by silhouette")
]

_BALL_MM = 8.0
_VISIBLE = 0.9


@cli.callback()
def templates() -> None:
    """Build the template sets that detection compares images with."""


@cli.command()
def build(
    folders: Annotated[list[Path], typer.Argument(help="Folders with left.png, right.png and truth.json.")],
    rig: Annotated[Path, typer.Option(help="The rig JSON that the images were taken with.")],
    out: Annotated[Path, typer.Option(help="Where to write the set.")],
    version: Annotated[str, typer.Option(help="Name stored with every result.")],
    gray_classes: Classes = None,
    edge_classes: Classes = None,
    directivity_classes: Classes = None,
) -> None:
    """Build a template set from images whose ball centres are annotated (thesis section 4.3.2)."""
    # The command line starts without the libraries that it does not need.
    from commands.shared.template_report import print_built_set  # noqa: PLC0415
    from spinewatch.detection.candidates.search import DetectionParameters  # noqa: PLC0415
    from spinewatch.detection.candidates.template_building import BuildParameters, build_template_set  # noqa: PLC0415
    from spinewatch.detection.candidates.templates import write_template_set  # noqa: PLC0415
    from spinewatch.rig_files.rig_json import parse_rig  # noqa: PLC0415

    cameras = parse_rig(rig.read_bytes())
    views = [_view(folder, side, cameras) for folder in folders for side in ("left", "right")]
    parameters = BuildParameters(gray_classes, edge_classes, directivity_classes)
    built = build_template_set(views, version, parameters, DetectionParameters())
    out.write_bytes(write_template_set(built.templates))
    print_built_set(built)
    typer.echo(f"{out}: version {version}, {sum(len(view.centres_px) for view in views)} balls")


def _view(folder: Path, side: Side, rig: Rig) -> AnnotatedView:
    import numpy as np  # noqa: PLC0415

    from spinewatch.detection.candidates.template_building import AnnotatedView  # noqa: PLC0415
    from spinewatch.imaging.decoding import decode_image  # noqa: PLC0415

    truth: dict[str, Any] = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    camera = rig.left if side == "left" else rig.right
    balls = [
        b for t in truth["triads"] for b in t["balls"].values() if b[side]["visible_fraction"] > _VISIBLE
    ]
    return AnnotatedView(
        decode_image((folder / f"{side}.png").read_bytes()),
        side,
        np.array([b[side]["center_px"] for b in balls]),
        np.array([camera.ball_diameter_px(_BALL_MM, camera.depth_mm(b["center_mm"])) for b in balls]),
    )
