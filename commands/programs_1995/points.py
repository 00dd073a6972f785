"""Image points of one image, from a CSV file."""

from __future__ import annotations

from pathlib import Path

from commands.shared.files import InputError, printable_name, read_text
from spinewatch.calibration.point_tables import parse_image_points
from spinewatch.calibration.points import ImagePoints


def read_image_points(path: Path) -> ImagePoints:
    """Return the image points of a CSV file with a single shot."""
    shots = parse_image_points(read_text(path), printable_name(path.name))
    if len(shots) != 1:
        raise InputError(
            f"{path} has {len(shots)} shots; the programs of 1995 take one, `spinewatch calibrate` several"
        )
    return next(iter(shots.values()))
