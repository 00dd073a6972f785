"""Calibrations of one, three or more cameras, from files of image points to a document."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from commands.shared.calibration_options import parse_sensor
from commands.shared.files import printable_name, read_text
from commands.shared.stopwatch import Stopwatch
from contract.cameras import CamerasResult
from spinewatch.calibration.cameras import calibrate_cameras
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.errors import ParameterError


def calibrate_camera_points(
    files: Sequence[Path], solve: SolveParameters, image_size: str | None, pixel_size: str | None
) -> dict[str, Any]:
    """Return the document of cameras calibrated from one CSV file of image points per camera, named after its file."""
    names = [printable_name(path.stem) for path in files]
    if len(set(names)) < len(names):
        raise ParameterError("two files have the same name, which names their camera; rename one of them")
    sensor = parse_sensor(image_size, pixel_size)
    points = {
        name: parse_image_points(read_text(path), printable_name(path.name))
        for name, path in zip(names, files, strict=True)
    }
    clock = Stopwatch()
    clock("calibrate")
    result = calibrate_cameras(points, sensor, solve)
    return {
        **CamerasResult.of(result, version("spinewatch")).model_dump(mode="json"),
        "calibrated_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "timings_ms": clock.stop(),
    }
