"""A calibration from files to its document, with every doubt about the files named."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from commands.files import read_bytes, read_text
from commands.stopwatch import Stopwatch
from spinewatch.calibration.collinearity import EXTERIOR, NAMES
from spinewatch.calibration.control_field import BUILT_IN, ControlField
from spinewatch.calibration.errors import ControlFieldError, PointsError
from spinewatch.calibration.from_images import (
    CalibrationResult,
    FromImagesParameters,
    Progress,
    calibrate_from_images,
    calibrate_from_points,
    silent,
)
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.resection import SolveParameters
from spinewatch.camera import Float
from spinewatch.errors import ImageError, ParameterError
from spinewatch.formats.calibration_json import calibration_document
from spinewatch.formats.control_csv import built_in_field, parse_control_field, parse_image_points
from spinewatch.formats.images import Gray, decode_image

Pair = tuple[Path, Path]


def run_images(
    pairs: Sequence[Pair],
    control_field: str | None,
    solve: SolveParameters,
    pixel_size: str | None,
    verify: int,
    name: str,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Return the document of a calibration from pictures."""
    if control_field is None:
        raise ParameterError(f"give --control-field: a CSV, or one of {', '.join(BUILT_IN)}")
    field = read_field(control_field)
    data = {path: read_bytes(path) for pair in pairs for path in pair}
    names = _shot_names(pairs)
    pixel = None if pixel_size is None else _two_numbers(pixel_size, ",", "--pixel-size")
    clock = Stopwatch()
    clock("decode")

    def step(what: str, fraction: float) -> None:
        clock(what)
        progress(what, fraction)

    shots = [(_picture(left, data[left]), _picture(right, data[right])) for left, right in pairs]
    parameters = FromImagesParameters(pixel_size_mm=pixel, solve=solve)
    result = calibrate_from_images(shots, field, parameters, step, names=names, verify=verify, rig_name=name)
    timings = clock.stop()
    images = [
        {"shot": shot, "side": side, "file": path.name, "sha256": hashlib.sha256(data[path]).hexdigest()}
        for shot, pair in zip(names, pairs, strict=True)
        for side, path in zip(("left", "right"), pair, strict=True)
    ]
    return _document(result, timings, images)


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
    return _document(result, clock.stop(), [])


def sensor_of(image_size: str | None, pixel_size: str | None) -> Sensor:
    """Return the sensor of --image-size and --pixel-size; without the latter the cart's."""
    if image_size is None:
        raise ParameterError("give --image-size, like 568x416: coordinates do not tell it")
    width, height = _two_numbers(image_size, "x", "--image-size")
    size = (int(width), int(height))
    if pixel_size is None:
        return Sensor.of_cart(size)
    return Sensor(size, _two_numbers(pixel_size, ",", "--pixel-size"))


def solve_parameters(free: str | None, fix: str | None, estimate_aspect: bool) -> SolveParameters:
    """Return the parameters of --free, --fix and --estimate-aspect; raises ``ParameterError``."""
    names = None
    if free is not None:
        words = tuple(word.strip() for word in free.split(","))
        _refuse_unknown(words)
        names = (*EXTERIOR, *(word for word in words if word not in EXTERIOR))
    fixed = {}
    for item in (fix or "").split(",") if fix else ():
        key, _, value = item.partition("=")
        _refuse_unknown((key.strip(),))
        try:
            fixed[key.strip()] = float(value)
        except ValueError as error:
            raise ParameterError(f"--fix {item!r} is not NAME=NUMBER, like x0=0") from error
    return SolveParameters(free=names, fixed=fixed, estimate_aspect=estimate_aspect)


def read_field(control_field: str) -> ControlField:
    """Return the built-in control field of that name, or the one in that CSV file."""
    field = built_in_field(control_field)
    if field is not None:
        return field
    path = Path(control_field)
    if not path.is_file():
        raise ControlFieldError(
            f"{control_field} is neither a file nor a built-in control field; built in: {', '.join(BUILT_IN)}"
        )
    return parse_control_field(read_text(path), path.name)


def _document(
    result: CalibrationResult, timings: Mapping[str, float], images: list[dict[str, str]]
) -> dict[str, Any]:
    return {
        **calibration_document(result),
        "calibrated_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "images": images,
        "timings_ms": dict(timings),
    }


def _refuse_unknown(names: Sequence[str]) -> None:
    for name in names:
        if name not in NAMES[6:] and name not in EXTERIOR:
            raise ParameterError(f"{name!r} is not a camera parameter; choose from {', '.join(NAMES[6:])}")


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


def _picture(path: Path, data: bytes) -> Gray:
    try:
        return decode_image(data)
    except ImageError as error:
        raise ImageError(f"{path}: {error}") from error
