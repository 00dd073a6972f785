"""``spinewatch simulate``: simulated scenes with their truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from commands.shared.files import make_folder, write_text
from commands.shared.labels import parse_labels
from commands.shared.numbers import MAX_SEED


def simulate(  # noqa: PLR0913, PLR0917 - one argument per option
    out: Annotated[Path, typer.Argument(help="Folder to write to, one subfolder per scene.")],
    rig: Annotated[Path, typer.Option(help="Rig JSON: true calibration of both cameras.")],
    scenes: Annotated[int, typer.Option(min=1, max=10_000, help="Number of scenes.")] = 1,
    labels: Annotated[
        str, typer.Option(help="Vertebrae with a triad, in order along the spine.")
    ] = "L1,T11,T9,T7",
    spine_axis: Annotated[Literal["x", "y"], typer.Option(help="Object axis along the spine.")] = "x",
    spacing: Annotated[
        float, typer.Option(min=1.0, max=200.0, help="Distance between neighbours, mm.")
    ] = 50.0,
    bend: Annotated[
        float,
        typer.Option(
            min=-180.0, max=180.0, help="Change of direction of the spine from end to end, degrees."
        ),
    ] = 0.0,
    noise: Annotated[
        float, typer.Option(min=0.0, max=5.0, help="Standard deviation of ball centres, per axis, px.")
    ] = 0.1,
    false_features: Annotated[
        int, typer.Option(min=0, max=10_000, help="Number of false features per image.")
    ] = 10,
    hidden: Annotated[
        int, typer.Option(min=0, max=30, help="Number of triads with one ball hidden in one view.")
    ] = 0,
    calibration_error: Annotated[
        tuple[float, float],
        typer.Option(
            min=0.0,
            max=100.0,
            help="Calibration error of the right camera: standard deviations per axis, degrees and mm.",
        ),
    ] = (0.0, 0.0),
    seed: Annotated[
        int,
        typer.Option(
            min=0, max=MAX_SEED, help="Seed of the random numbers; the same seed gives the same scenes."
        ),
    ] = 0,
) -> None:
    """Write scenes without images: truth.json in the format of rendered scenes, features.json and rig.json."""
    names = parse_labels(labels, None)
    import numpy as np  # noqa: PLC0415 - --help does not need it

    from commands.shared.rig import read_rig  # noqa: PLC0415
    from contract.features import FeaturePair  # noqa: PLC0415
    from spinewatch.rig_files.rig_json import rig_to_dict  # noqa: PLC0415
    from spinewatch.simulation.observations import FeatureNoise  # noqa: PLC0415
    from spinewatch.simulation.scenes import (  # noqa: PLC0415
        SceneParameters,
        simulate_scene,
        truth_document,
    )

    rotation_sd_deg, shift_sd_mm = calibration_error
    parameters = SceneParameters(
        labels=names,
        axis=spine_axis,
        spacing_mm=spacing,
        bend_deg=bend,
        noise=FeatureNoise(noise, 0.0, false_features),
        hidden=hidden,
        calibration_sd_deg=rotation_sd_deg,
        calibration_sd_mm=shift_sd_mm,
    )
    true_rig = read_rig(rig)
    for number in range(scenes):
        name = f"s{number:04d}"
        scene = simulate_scene(true_rig, parameters, np.random.default_rng([seed, number]))
        folder = out / name
        make_folder(folder)
        documents = {
            "truth.json": truth_document(scene, name),
            "features.json": FeaturePair.of(scene.observation.left, scene.observation.right).model_dump(
                mode="json"
            ),
            "rig.json": rig_to_dict(scene.rig),
        }
        for file, document in documents.items():
            write_text(folder / file, json.dumps(document, indent=1) + "\n")
    typer.echo(f"{scenes} scenes in {out}")
