"""Calibrations of a stereo rig, from the paths and options of ``calibrate`` to a document."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from commands.shared.calibration_options import parse_pixel_size, parse_sensor
from commands.shared.files import printable_name, read_image, read_text
from commands.shared.stopwatch import Stopwatch
from contract.calibration_quality import calibration_result
from spinewatch.arrays import Float
from spinewatch.calibration.control_field import BUILT_IN_FIELDS, ControlField
from spinewatch.calibration.errors import PointsError
from spinewatch.calibration.files import ShotFiles, calibrate_files, load_control_field
from spinewatch.calibration.from_images import CalibrationParameters, CalibrationResult, calibrate_from_points
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.points import ImagePoints, Shot
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.errors import ParameterError
from spinewatch.progress import Progress, silent

Pair = tuple[Path, Path]


def calibrate_images(
    pairs: Sequence[Pair],
    field_name: str | None,
    solve: SolveParameters,
    pixel_size: str | None,
    verify: int,
    name: str,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Return the document of a calibration from image files; ``field_name`` is built in or a CSV file."""
    if field_name is None:
        raise ParameterError(
            f"give --control-field: a CSV file, one of {', '.join(BUILT_IN_FIELDS)}, or a board such as"
            " chessboard:9x6:25"
        )
    require_calibration_shots(verify, len(pairs))
    field = read_field(field_name)
    shots = [
        ShotFiles(shot, read_image(left), read_image(right))
        for shot, (left, right) in zip(_shot_names(pairs), pairs, strict=True)
    ]
    clock = Stopwatch()

    def step(what: str, fraction: float) -> None:
        clock(what)
        progress(what, fraction)

    parameters = CalibrationParameters(pixel_size_mm=parse_pixel_size(pixel_size), solve=solve)
    result = calibrate_files(shots, field, parameters, step, verify=verify, rig_name=name)
    timings = clock.stop()
    images = [
        {
            "shot": shot.name,
            "side": side,
            "file": printable_name(path.name),
            "sha256": hashlib.sha256(content).hexdigest(),
        }
        for shot, pair in zip(shots, pairs, strict=True)
        for side, path, content in zip(("left", "right"), pair, (shot.left, shot.right), strict=True)
    ]
    return _document(result, timings, images)


def calibrate_points(
    files: Pair,
    solve: SolveParameters,
    image_size: str | None,
    pixel_size: str | None,
    verify: int,
    name: str,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Return the document of a calibration from two CSV files of image points, left and right."""
    sensor = parse_sensor(image_size, pixel_size)
    left, right = (parse_image_points(read_text(path), printable_name(path.name)) for path in files)
    shots = _shots(left, right)
    require_calibration_shots(verify, len(shots))
    clock = Stopwatch()
    clock("calibrate")
    result = calibrate_from_points(
        shots,
        _field_of(shots),
        (sensor, sensor),
        CalibrationParameters(solve=solve),
        progress,
        verify=verify,
        rig_name=name,
    )
    return _document(result, clock.stop(), [])


def require_calibration_shots(verify: int, shots: int) -> None:
    """Raise ``ParameterError`` unless ``verify`` of the shots leave at least one to calibrate with."""
    if not 0 <= verify < shots:
        raise ParameterError(f"--verify is {verify} of {shots} shots; leave at least one to calibrate with")


def read_field(name: str) -> ControlField:
    """Return the built-in control field of that name, or the one in the CSV file of that name."""
    path = Path(name)
    if name not in BUILT_IN_FIELDS and os.path.isfile(path):
        return load_control_field(printable_name(path.name), read_text(path))
    return load_control_field(name)


def _document(
    result: CalibrationResult, timings: Mapping[str, float], images: list[dict[str, str]]
) -> dict[str, Any]:
    return {
        **calibration_result(result, version("spinewatch")).model_dump(mode="json", by_alias=True),
        "calibrated_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "images": images,
        "timings_ms": dict(timings),
    }


def _shot_names(pairs: Sequence[Pair]) -> list[str]:
    """Return the folders of the left images, or their file names, or numbers: the first that are all different."""
    folders = [printable_name(left.parent.name) for left, _ in pairs]
    stems = [printable_name(left.stem) for left, _ in pairs]
    for names in (folders, stems):
        if all(names) and len(set(names)) == len(names) and len(names) > 1:
            return names
    return [str(i + 1) for i in range(len(pairs))]


def _shots(left: Mapping[str, ImagePoints], right: Mapping[str, ImagePoints]) -> list[Shot]:
    if unpaired := set(left) ^ set(right):
        raise PointsError(
            f"shot {min(unpaired)} is in only one of the two files; give both sides of every shot"
        )
    return [Shot(name, left[name], right[name]) for name in left]


def _field_of(shots: Sequence[Shot]) -> ControlField:
    """Return the control field that consists of the control points of all shots."""
    points: dict[str, Float] = {}
    for shot in shots:
        for image in (shot.left, shot.right):
            points.update(zip(image.ids, image.control_mm, strict=True))
    return ControlField("from coordinates", tuple(points), np.array(list(points.values())))
