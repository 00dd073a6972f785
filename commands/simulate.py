"""``spinewatch simulate``: write simulated scenes with their truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from commands.process import label_names


def simulate(  # noqa: PLR0913, PLR0917 - a command has as many options as there are things to choose
    out: Annotated[Path, typer.Argument(help="Folder to write the scenes into, one folder each.")],
    rig: Annotated[Path, typer.Option(help="Rig JSON: the true cameras.")],
    scenes: Annotated[int, typer.Option(min=1, help="How many scenes.")] = 1,
    labels: Annotated[str, typer.Option(help="Vertebrae with a triad.")] = "L1,T11,T9,T7",
    spine_axis: Annotated[Literal["x", "y"], typer.Option(help="Object axis of the row.")] = "x",
    spacing: Annotated[float, typer.Option(min=1.0, help="Distance between neighbours, mm.")] = 50.0,
    bend: Annotated[float, typer.Option(help="Turn of the row from end to end, degrees.")] = 0.0,
    noise: Annotated[float, typer.Option(min=0.0, help="Standard deviation of a centre, px.")] = 0.1,
    false_features: Annotated[int, typer.Option(min=0, help="False features an image.")] = 10,
    hidden: Annotated[int, typer.Option(min=0, help="Triads that lack a ball in one view.")] = 0,
    calibration_error: Annotated[
        tuple[float, float], typer.Option(help="Of the right camera: degrees and mm, per axis.")
    ] = (0.0, 0.0),
    seed: Annotated[int, typer.Option(help="The same seed gives the same scenes.")] = 0,
) -> None:
    """Write scenes without pictures: truth.json as of rendered scenes, features.json, and rig.json to measure with."""
    names = label_names(labels, None)
    import numpy as np  # noqa: PLC0415 - --help can do without

    from commands.shared.pair import read_rig  # noqa: PLC0415
    from contract.stage_documents import features_document  # noqa: PLC0415
    from spinewatch.rig_files.rig_json import rig_to_dict  # noqa: PLC0415
    from spinewatch.simulation.observations import Noise  # noqa: PLC0415
    from spinewatch.simulation.scenes import (  # noqa: PLC0415
        SceneParameters,
        simulate_scene,
        truth_document,
    )

    turn, shift = calibration_error
    parameters = SceneParameters(
        labels=names,
        axis=spine_axis,
        spacing_mm=spacing,
        bend_deg=bend,
        noise=Noise(noise, 0.0, false_features),
        hidden=hidden,
        calibration_sd_deg=turn,
        calibration_sd_mm=shift,
    )
    true_rig = read_rig(rig)
    for number in range(scenes):
        name = f"s{number:04d}"
        scene = simulate_scene(true_rig, parameters, np.random.default_rng([seed, number]))
        folder = out / name
        folder.mkdir(parents=True, exist_ok=True)
        documents = {
            "truth.json": truth_document(scene, name),
            "features.json": {
                "left": features_document(scene.seen.left),
                "right": features_document(scene.seen.right),
            },
            "rig.json": rig_to_dict(scene.rig),
        }
        for file, document in documents.items():
            (folder / file).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    typer.echo(f"{scenes} scenes in {out}")
