"""A calibration from the user's paths and options to its document; ``formats/calibration_files`` does the work."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from commands.shared.files import read_bytes, read_text
from commands.shared.stopwatch import Stopwatch
from contract.calibration_documents import calibration_document
from spinewatch.arrays import Float
from spinewatch.calibration.control_field import BUILT_IN, ControlField
from spinewatch.calibration.errors import PointsError
from spinewatch.calibration.files import ShotFiles, calibrate_files, control_field, solve_parameters
from spinewatch.calibration.from_images import FromImagesParameters, calibrate_from_points
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.solve.resection import SolveParameters
from spinewatch.errors import ParameterError
from spinewatch.progress import Progress, silent

Pair = tuple[Path, Path]


def run_images(
    pairs: Sequence[Pair],
    field_or_file: str | None,
    solve: SolveParameters,
    pixel_size: str | None,
    verify: int,
    name: str,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Return the document of a calibration from pictures."""
    if field_or_file is None:
        raise ParameterError(f"give --control-field: a CSV, or one of {', '.join(BUILT_IN)}")
    field = read_field(field_or_file)
    names = _shot_names(pairs)
    shots = [
        ShotFiles(shot, read_bytes(left), read_bytes(right))
        for shot, (left, right) in zip(names, pairs, strict=True)
    ]
    pixel = None if pixel_size is None else _two_numbers(pixel_size, ",", "--pixel-size")
    clock = Stopwatch()

    def step(what: str, fraction: float) -> None:
        clock(what)
        progress(what, fraction)

    parameters = FromImagesParameters(pixel_size_mm=pixel, solve=solve)
    document = calibrate_files(shots, field, parameters, step, verify=verify, rig_name=name)
    timings = clock.stop()
    images = [
        {"shot": shot.name, "side": side, "file": path.name, "sha256": hashlib.sha256(content).hexdigest()}
        for shot, pair in zip(shots, pairs, strict=True)
        for side, path, content in zip(("left", "right"), pair, (shot.left, shot.right), strict=True)
    ]
    return _dated(document, timings, images)


def run_points(
    pairs: Sequence[Pair],
    solve: SolveParameters,
    image_size: str | None,
    pixel_size: str | None,
    verify: int,
    name: str,
) -> dict[str, Any]:
    """Return the document of a calibration from two CSV files of image points."""
    if len(pairs) != 1:
        raise ParameterError("give two CSV files, LEFT and RIGHT; several shots go into a column named shot")
    sensor = sensor_of(image_size, pixel_size)
    left, right = (parse_image_points(read_text(path), path.name) for path in pairs[0])
    shots = _shots(left, right)
    if not 0 <= verify < len(shots):
        raise ParameterError(
            f"--verify is {verify} of {len(shots)} shots; leave at least one to calibrate with"
        )
    clock = Stopwatch()
    clock("calibrate")
    result = calibrate_from_points(
        shots, _field_of(shots), (sensor, sensor), solve, verify=verify, rig_name=name
    )
    return _dated(calibration_document(result), clock.stop(), [])


def sensor_of(image_size: str | None, pixel_size: str | None) -> Sensor:
    """Return the sensor of --image-size and --pixel-size; without the latter the cart's."""
    if image_size is None:
        raise ParameterError("give --image-size, like 568x416: coordinates do not tell it")
    width, height = _two_numbers(image_size, "x", "--image-size")
    size = (int(width), int(height))
    if pixel_size is None:
        return Sensor.of_cart(size)
    return Sensor(size, _two_numbers(pixel_size, ",", "--pixel-size"))


def solve_options(free: str | None, fix: str | None, estimate_aspect: bool) -> SolveParameters:
    """Return the parameters of --free, --fix and --estimate-aspect; raises ``ParameterError``."""
    fixed = {}
    for item in (fix or "").split(",") if fix else ():
        key, _, value = item.partition("=")
        try:
            fixed[key.strip()] = float(value)
        except ValueError as error:
            raise ParameterError(f"--fix {item!r} is not NAME=NUMBER, like x0=0") from error
    names = None if free is None else [word.strip() for word in free.split(",")]
    return solve_parameters(names, fixed, estimate_aspect)


def read_field(name_or_file: str) -> ControlField:
    """Return the built-in control field of that name, or the one in that CSV file."""
    path = Path(name_or_file)
    if name_or_file not in BUILT_IN and path.is_file():
        return control_field(path.name, read_text(path))
    return control_field(name_or_file)


def _dated(
    document: Mapping[str, Any], timings: Mapping[str, float], images: list[dict[str, str]]
) -> dict[str, Any]:
    return {
        **document,
        "calibrated_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "images": images,
        "timings_ms": dict(timings),
    }


def _shot_names(pairs: Sequence[Pair]) -> list[str]:
    folders = [left.parent.name for left, _ in pairs]
    stems = [left.stem for left, _ in pairs]
    for names in (folders, stems):
        if all(names) and len(set(names)) == len(names) and len(names) > 1:
            return names
    return [str(i + 1) for i in range(len(pairs))]


def _shots(left: Mapping[str, ImagePoints], right: Mapping[str, ImagePoints]) -> list[Shot]:
    alone = set(left) ^ set(right)
    if alone:
        raise PointsError(
            f"shot {sorted(alone)[0]} is in one of the two files only; give both sides of every shot"
        )
    return [Shot(name, left[name], right[name]) for name in left]


def _field_of(shots: Sequence[Shot]) -> ControlField:
    points: dict[str, Float] = {}
    for shot in shots:
        for image in (shot.left, shot.right):
            points.update(zip(image.ids, image.control_mm, strict=True))
    return ControlField("from coordinates", tuple(points), np.array(list(points.values())))


def _two_numbers(text: str, separator: str, option: str) -> tuple[float, float]:
    try:
        a, b = (float(part) for part in text.lower().split(separator))
    except ValueError as error:
        raise ParameterError(f"{option} {text!r} must be two numbers separated by {separator!r}") from error
    if not (a > 0 and b > 0):
        raise ParameterError(f"{option} {text!r} must be positive")
    return a, b
