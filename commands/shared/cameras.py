"""One, three or more cameras from files of coordinates to their document."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from commands.shared.calibration import sensor_of
from commands.shared.files import read_text
from commands.shared.stopwatch import Stopwatch
from contract.cameras_documents import cameras_document
from spinewatch.calibration.cameras import calibrate_cameras
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.solve.resection import SolveParameters
from spinewatch.errors import ParameterError


def run_cameras(
    files: Sequence[Path], solve: SolveParameters, image_size: str | None, pixel_size: str | None
) -> dict[str, Any]:
    """Return the document of cameras calibrated from one CSV file of image points each, named by its stem."""
    names = [path.stem for path in files]
    if len(set(names)) < len(names):
        raise ParameterError("two files have the same name, which names their camera; rename one of them")
    sensor = sensor_of(image_size, pixel_size)
    seen = {
        name: parse_image_points(read_text(path), path.name) for name, path in zip(names, files, strict=True)
    }
    clock = Stopwatch()
    clock("calibrate")
    result = calibrate_cameras(seen, sensor, solve)
    return {
        **cameras_document(result),
        "calibrated_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "timings_ms": clock.stop(),
    }
